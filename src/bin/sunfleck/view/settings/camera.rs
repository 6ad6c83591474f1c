//! The camera: which one, where it stands, its lens.

use eframe::egui;
use egui::Ui;
use sunfleck::scene::settings::{CameraSettings, Settings};
use sunfleck::scene::{Camera, Projection, Scene};

use super::number::{Number, drag_sized, metres, slider};
use super::widgets::{Name, named, row};
use crate::progress::decimals;
use crate::view::app::Viewer;
use crate::view::engine::Message;
use crate::view::focus::list;

const CAMERA: Name = Name { name: "Camera", hint: "One of the scene's cameras. Restarts the estimate." };
const POSITION: Name =
    Name { name: "Position", hint: "x, y and z, metres; 5 mm or 2 km can be typed, too. Restarts the estimate." };
const VIEW: Name =
    Name { name: "Field of view", hint: "Full vertical angle of the view, degrees. Restarts the estimate." };
const HEIGHT: Name = Name { name: "Half height", hint: "Half the height of the view, metres. Restarts the estimate." };
const APERTURE: Name = Name {
    name: "Aperture",
    hint: "Radius of the lens, metres: larger, and what is out of focus blurs more; 0 is a pinhole. Restarts the \
           estimate.",
};
const FOCUS: Name = Name {
    name: "Focus",
    hint: "Distance of the plane in focus, metres; seen only with an aperture above 0. Restarts the estimate.",
};

pub fn show(ui: &mut Ui, viewer: &mut Viewer, read: &Settings) {
    let Some(opened) = viewer.opened().cloned() else { return };
    let Some(camera) = viewer.rig().map(|rig| rig.camera().clone()) else {
        let hint = "The settings name a camera that the scene does not have.";
        ui.colored_label(ui.visuals().warn_fg_color, "No such camera").on_hover_text(hint);
        return;
    };
    which(ui, viewer, read, &opened.loaded.scene);
    let file = file_of(viewer, read, &opened.loaded.scene);
    place(ui, viewer, &camera, file.as_ref());
    lens(ui, viewer, &camera, file.as_ref());
    ui.horizontal_wrapped(|ui| {
        let hint = "Moves the camera until the scene is in the picture, but for what lies far outside; in a closed room to \
                    where it began (F). Restarts the estimate.";
        if ui.button("Frame all").on_hover_text(hint).clicked() {
            viewer.frame_all(ui.input(|i| i.time));
        }
        let hint = "The camera as --set flags for `sunfleck render`, to the clipboard";
        if ui.button("Copy camera as flags").on_hover_text(hint).clicked() {
            let flags = flags(&viewer.settings(), read);
            let text = if flags.is_empty() { "the camera is the file's: no flags" } else { "copied the camera" };
            if !flags.is_empty() {
                ui.ctx().copy_text(flags);
            }
            viewer.say(ui, Message::Said(text.to_owned()));
        }
    });
}

/// What turns the file's camera into this one, on the command line.
fn flags(now: &Settings, read: &Settings) -> String {
    let only = |settings: &Settings| Settings { camera: settings.camera.clone(), ..Settings::default() };
    let pairs = only(now).difference(&only(read));
    let flags: Vec<_> = pairs.iter().map(|pair| format!("--set {}", crate::render::quote(pair))).collect();
    flags.join(" ")
}

/// One of the scene's cameras as settings say it: by name where that means only this one.
fn chosen(scene: &Scene, index: usize) -> CameraSettings {
    let camera = &scene.cameras[index];
    let first = scene.cameras.iter().position(|other| other.name == camera.name);
    match first == Some(index) && !camera.name.is_empty() {
        true => CameraSettings { name: Some(camera.name.clone()), ..CameraSettings::default() },
        false => camera.into(),
    }
}

/// Whether settings say no more than which camera of the scene: as the panel, or by number.
fn is_chosen(scene: &Scene, index: usize, settings: &CameraSettings) -> bool {
    let by_number = CameraSettings { name: Some(index.to_string()), ..CameraSettings::default() };
    *settings == chosen(scene, index)
        || *settings == by_number && scene.cameras.iter().all(|c| Some(&c.name) != settings.name.as_ref())
}

/// What to call it.
fn title(camera: &Camera, index: usize) -> String {
    if camera.name.is_empty() { format!("camera {index}") } else { camera.name.clone() }
}

fn which(ui: &mut Ui, viewer: &mut Viewer, read: &Settings, scene: &Scene) {
    let now = viewer.settings();
    let is_the_files = now.camera == read.camera;
    let current = match &now.camera {
        None => Some(0),
        Some(camera) => (0..scene.cameras.len()).find(|&i| is_chosen(scene, i, camera)),
    };
    let text = match current {
        Some(i) => title(&scene.cameras[i], i),
        None if is_the_files => "the settings file's".to_owned(),
        None => "moved by hand".to_owned(),
    };
    let mut picked = None;
    let reset = row(ui, CAMERA, !is_the_files, |ui| {
        let combo = egui::ComboBox::from_id_salt("camera").width(ui.available_width()).selected_text(text).truncate();
        list(ui, combo, |ui| {
            for (i, camera) in scene.cameras.iter().enumerate() {
                if ui.selectable_label(current == Some(i), title(camera, i)).clicked() {
                    picked = Some(i);
                }
            }
        })
    });
    if let Some(i) = picked {
        // The first is taken without a word.
        let camera = (i > 0 || read.camera.is_some()).then(|| chosen(scene, i));
        viewer.edits.end_step();
        viewer.edit(ui, "which camera", |s| s.camera = camera);
    }
    if reset {
        viewer.reset(ui, |s| s.camera = read.camera.clone());
    }
}

/// What there is to go back to, field by field, of a camera that was moved.
struct File {
    /// The camera as the file has it.
    camera: CameraSettings,
    /// The same as the file says it.
    read: Option<CameraSettings>,
}

fn file_of(viewer: &Viewer, read: &Settings, scene: &Scene) -> Option<File> {
    let now = viewer.settings();
    let moved = now.camera.as_ref().filter(|camera| Some(*camera) != read.camera.as_ref())?;
    // One of the scene's is changed in nothing.
    let is_whole = (0..scene.cameras.len()).any(|i| is_chosen(scene, i, moved));
    let camera = read.camera_of(&scene.cameras).ok().filter(|_| !is_whole)?;
    Some(File { camera: (&camera).into(), read: read.camera.clone() })
}

/// A number of a camera's settings.
type Field = fn(&mut CameraSettings) -> &mut Option<f32>;

impl File {
    fn differs(&self, now: &CameraSettings, field: Field) -> bool {
        let [now, was] = [now, &self.camera].map(|settings| field(&mut settings.clone()).unwrap_or(0.0));
        !is_near(now, was)
    }
}

/// As near as degrees come back from radians.
fn is_near(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-5 * b.abs()
}

/// Takes a field back; with the last one the camera is the file's again.
fn reset_field(ui: &Ui, viewer: &mut Viewer, now: &Camera, file: &File, change: impl FnOnce(&mut CameraSettings)) {
    let mut settings = CameraSettings::from(now);
    change(&mut settings);
    let lens = |s: &CameraSettings| {
        [s.yfov_degrees, s.ymag, s.aperture_radius, s.focus_distance].map(Option::unwrap_or_default)
    };
    let same_lens = lens(&settings).into_iter().zip(lens(&file.camera)).all(|(a, b)| is_near(a, b));
    let turned = |a: Option<[f32; 3]>, b: Option<[f32; 3]>| {
        glam::Vec3::from(a.unwrap_or_default()).distance(b.unwrap_or_default().into()) > 1e-5
    };
    let is_turned = turned(settings.forward, file.camera.forward) || turned(settings.up, file.camera.up);
    let is_files = settings.position == file.camera.position && same_lens && !is_turned;
    let camera = if is_files { file.read.clone() } else { Some(settings) };
    viewer.reset(ui, |s| s.camera = camera);
}

fn place(ui: &mut Ui, viewer: &mut Viewer, camera: &Camera, file: Option<&File>) {
    let mut settings = CameraSettings::from(camera);
    let mut position = settings.position.unwrap_or_default();
    let mut changed = false;
    let was = file.and_then(|file| file.camera.position).filter(|was| *was != position);
    let size = f64::from(viewer.scene_size());
    let reset = row(ui, POSITION, was.is_some(), |ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        // So that a sign does not widen the panel.
        ui.spacing_mut().button_padding.x = 1.0;
        let each = egui::vec2(((ui.available_width() - 4.0) / 3.0).max(20.0), ui.spacing().interact_size.y);
        // Not by the distance in focus, which a scene's file need not say.
        let number = Number::Coordinate(decimals(size));
        let mut drag =
            |value: &mut f32, name: &str| named(drag_sized(ui, each, value, number, 0.002 * size, -1e9..=1e9), name);
        let [x, y, z] = &mut position;
        let response = drag(x, "x") | drag(y, "y") | drag(z, "z");
        changed = response.changed();
        response
    });
    if changed {
        settings.position = Some(position);
        viewer.edit(ui, "camera", |s| s.camera = Some(settings));
    }
    if let (true, Some(file)) = (reset, file) {
        reset_field(ui, viewer, camera, file, |settings| settings.position = was);
    }
}

fn lens(ui: &mut Ui, viewer: &mut Viewer, camera: &Camera, file: Option<&File>) {
    let (time, size) = (ui.input(|i| i.time), viewer.scene_size());
    let now = CameraSettings::from(camera);
    let differs = |field| file.is_some_and(|file| file.differs(&now, field));
    let mut back;
    match camera.projection {
        Projection::Perspective { yfov } => {
            let mut degrees = f64::from(yfov.to_degrees());
            let field: Field = |settings| &mut settings.yfov_degrees;
            let reset = row(ui, VIEW, differs(field), |ui| {
                let response = slider(ui, &mut degrees, Number::Degrees, 5.0..=140.0);
                if response.changed() {
                    viewer.move_rig(time, &mut |rig| rig.set_yfov((degrees as f32).to_radians()));
                }
                response
            });
            back = reset.then_some(field);
        }
        Projection::Orthographic { mut ymag } => {
            let field: Field = |settings| &mut settings.ymag;
            let reset = row(ui, HEIGHT, differs(field), |ui| {
                let response = metres(ui, &mut ymag, 1e-6 * size, size);
                if response.changed() {
                    let settings = CameraSettings { ymag: Some(ymag), ..CameraSettings::from(camera) };
                    viewer.edit(ui, "camera", |s| s.camera = Some(settings));
                }
                response
            });
            back = reset.then_some(field);
        }
    }
    let (mut aperture, mut focus) = (camera.aperture_radius, camera.focus_distance);
    let field: Field = |settings| &mut settings.aperture_radius;
    let reset = row(ui, APERTURE, differs(field), |ui| {
        let response = metres(ui, &mut aperture, 0.0, size);
        if response.changed() {
            viewer.move_rig(time, &mut |rig| rig.set_aperture_radius(aperture));
        }
        response
    });
    back = back.or(reset.then_some(field));
    let field: Field = |settings| &mut settings.focus_distance;
    let reset = row(ui, FOCUS, differs(field), |ui| {
        let response = metres(ui, &mut focus, 1e-6 * size, size);
        if response.changed() {
            viewer.move_rig(time, &mut |rig| rig.set_focus_distance(focus));
        }
        response
    });
    back = back.or(reset.then_some(field));
    if let (Some(field), Some(file)) = (back, file) {
        let was = *field(&mut file.camera.clone());
        reset_field(ui, viewer, camera, file, |settings| *field(settings) = was);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn flags_are_what_differs_in_the_camera() {
        let camera = Camera::look_at("a", Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0);
        let read = Settings { camera: Some((&camera).into()), ..Settings::default() };
        let mut now = Settings { seed: Some(7), ..read.clone() };
        assert_eq!(flags(&now, &read), "");
        now.camera.as_mut().unwrap().position = Some([0.0, 0.5, 1.0]);
        assert_eq!(flags(&now, &read), "--set 'camera.position=[0.0, 0.5, 1.0]'");
    }

    #[test]
    fn cameras_are_named_where_a_name_means_one() {
        let camera = |name: &str, z: f32| Camera::look_at(name, Vec3::Z * z, Vec3::ZERO, Vec3::Y, 1.0);
        let cameras = vec![camera("a", 1.0), camera("b", 2.0), camera("b", 3.0), camera("", 4.0)];
        let scene = Scene { cameras, ..Scene::default() };
        for i in 0..4 {
            let settings = Settings { camera: Some(chosen(&scene, i)), ..Settings::default() };
            let found = settings.camera_of(&scene.cameras).unwrap();
            assert_eq!(found.world_from_camera.translation.z, (i + 1) as f32);
            assert_eq!(chosen(&scene, i).name.is_some(), i < 2);
        }
    }
}
