//! The interface drawn into a texture, on a machine without a display: by what a window of eframe draws with, at the pace of
//! a display of 60 Hz that takes two frames ahead.

use std::collections::VecDeque;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use eframe::egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use eframe::{egui, wgpu};

use super::app::Viewer;
use super::window::{Bell, Drawn, Fault, Guest};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const REFRESH: Duration = Duration::from_micros(16_667);
/// Frames that the device may be behind.
const AHEAD: usize = 2;

/// Shows `viewer` in a window of `size` pixels until `guest` closes it.
pub fn run(viewer: &mut Viewer, bell: &Bell, guest: &mut impl Guest, size: [u32; 2]) -> Result<()> {
    let mut canvas = Canvas::new(size)?;
    let context = egui::Context::default();
    bell.hang(&context);
    viewer.enter(None, None);
    let (began, mut next) = (Instant::now(), Instant::now());
    let mut work = None;
    loop {
        let now = Instant::now();
        next = (next + REFRESH).max(now);
        let points = size.map(|side| side as f32 / context.pixels_per_point());
        let mut input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, points.into())),
            max_texture_side: Some(canvas.device.limits().max_texture_dimension_2d as usize),
            time: Some((now - began).as_secs_f64()),
            focused: true,
            ..Default::default()
        };
        guest.add_input(viewer, &mut input);
        let drawn = Drawn { work, device: Some(&canvas.device) };
        let output = context.run_ui(input, |ui| {
            viewer.show(ui, work);
            guest.after_frame(viewer, ui, &drawn);
        });
        let commands = output.viewport_output.values().flat_map(|viewport| &viewport.commands);
        let is_last = commands.into_iter().any(|command| matches!(command, egui::ViewportCommand::Close));
        let submitting = canvas.draw(&context, output)?;
        work = Some(now.elapsed().saturating_sub(submitting).as_secs_f32());
        if is_last {
            return Ok(());
        }
        canvas.wait()?;
        thread::sleep(next.saturating_duration_since(Instant::now()));
    }
}

/// What is drawn into.
struct Canvas {
    device: wgpu::Device,
    queue: wgpu::Queue,
    size: [u32; 2],
    renderer: Renderer,
    view: wgpu::TextureView,
    fault: Fault,
    submitted: VecDeque<wgpu::SubmissionIndex>,
}

impl Canvas {
    /// On the adapter that eframe would choose, apart from what the display asks of it.
    fn new(size: [u32; 2]) -> Result<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let wanted = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&wanted)).context("no adapter to draw with")?;
        let limits = adapter.limits();
        let most = limits.max_texture_dimension_2d;
        if size.iter().any(|&side| side > most) {
            bail!("the window may have {most} pixels a side: {} allows no more", adapter.get_info().name);
        }
        let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).context("no device to draw with")?;
        let fault = Fault::default();
        fault.watch(&device, || ());
        let [width, height] = size;
        let view = device
            .create_texture(&wgpu::TextureDescriptor {
                label: Some("window"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMAT,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
            .create_view(&wgpu::TextureViewDescriptor::default());
        let renderer = Renderer::new(&device, FORMAT, RendererOptions::default());
        Ok(Self { device, queue, size, renderer, view, fault, submitted: VecDeque::new() })
    }

    /// Returns what the queue took, which eframe counts as waiting for the display.
    fn draw(&mut self, context: &egui::Context, mut output: egui::FullOutput) -> Result<Duration> {
        let screen = ScreenDescriptor { size_in_pixels: self.size, pixels_per_point: output.pixels_per_point };
        let shapes = context.tessellate(output.shapes, output.pixels_per_point);
        for (id, deltas) in output.textures_delta.set.drain() {
            for delta in &deltas {
                self.renderer.update_texture(&self.device, &self.queue, id, delta);
            }
        }
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut commands = self.renderer.update_buffers(&self.device, &self.queue, &mut encoder, &shapes, &screen);
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.view,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
                depth_slice: None,
            })],
            ..Default::default()
        });
        self.renderer.render(&mut pass.forget_lifetime(), &shapes, &screen);
        commands.push(encoder.finish());
        let began = Instant::now();
        self.submitted.push_back(self.queue.submit(commands));
        let submitting = began.elapsed();
        output.textures_delta.free.drain().for_each(|id| self.renderer.free_texture(&id));
        match self.fault.get() {
            Some(fault) => bail!("the window's graphics device failed: {fault}"),
            None => Ok(submitting),
        }
    }

    /// Until the device is no more than so many frames behind.
    fn wait(&mut self) -> Result<()> {
        while self.submitted.len() > AHEAD {
            let submission_index = self.submitted.pop_front();
            self.device
                .poll(wgpu::PollType::Wait { submission_index, timeout: None })
                .map_err(|error| anyhow!("the window's graphics device failed: {error}"))?;
        }
        Ok(())
    }
}
