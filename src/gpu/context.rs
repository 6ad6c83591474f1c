//! Adapters and devices, their limits, and what goes wrong with them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use super::buffers::Readback;
use super::kernels::{Cache, Shared};
use crate::device::Error;

/// What an adapter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// Graphics in the processor, sharing its memory.
    Integrated,
    /// A part of a card, given to a virtual machine.
    Virtual,
    /// Software: shaders run on the processor.
    Cpu,
    /// The driver does not say.
    Other,
}

impl DeviceKind {
    /// What is chosen first if nothing else is said; of the same, the first in the list.
    fn rank(self) -> u32 {
        match self {
            Self::Discrete => 0,
            Self::Virtual => 1,
            Self::Integrated => 2,
            Self::Other => 3,
            Self::Cpu => 4,
        }
    }
}

impl std::fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Cpu => "software",
            Self::Other => "unknown kind",
        })
    }
}

/// An adapter that can be rendered with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// For [`Choice::Index`]; `usize::MAX` for a device of the caller's own.
    pub index: usize,
    /// As the driver gives it.
    pub name: String,
    /// Graphics interface: `vulkan`, `metal`, `dx12` or `gl`.
    pub backend: String,
    /// What it is.
    pub kind: DeviceKind,
    /// Driver and its version.
    pub driver: String,
    /// Whether it has ray queries, for [`Context::with_ray_queries`].
    pub ray_queries: bool,
}

impl DeviceInfo {
    fn new(index: usize, info: wgpu::AdapterInfo, features: wgpu::Features) -> Self {
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => DeviceKind::Discrete,
            wgpu::DeviceType::IntegratedGpu => DeviceKind::Integrated,
            wgpu::DeviceType::VirtualGpu => DeviceKind::Virtual,
            wgpu::DeviceType::Cpu => DeviceKind::Cpu,
            wgpu::DeviceType::Other => DeviceKind::Other,
        };
        let driver = format!("{} {}", info.driver, info.driver_info).trim().to_owned();
        let ray_queries = features.contains(RAY_QUERIES);
        Self { index, name: info.name, backend: info.backend.to_string(), kind, driver, ray_queries }
    }

    /// Whether this is hardware.
    pub fn is_real(&self) -> bool {
        matches!(self.kind, DeviceKind::Discrete | DeviceKind::Integrated | DeviceKind::Virtual)
    }
}

impl std::fmt::Display for DeviceInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({}, {}", self.name, self.backend, self.kind)?;
        if !self.driver.is_empty() {
            write!(f, ", {}", self.driver)?;
        }
        if self.ray_queries {
            f.write_str(", ray queries")?;
        }
        f.write_str(")")
    }
}

/// Which adapter to use.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// The best hardware, or nothing: a card, a part of one, graphics in the processor, in this order.
    Real,
    /// The same, or else software.
    #[default]
    Any,
    /// By [`DeviceInfo::index`].
    Index(usize),
    /// The best whose name contains this, whatever the case.
    Name(String),
}

/// All adapters that can be rendered with, in the order of their indices.
pub fn list_devices() -> Vec<DeviceInfo> {
    adapters().into_iter().map(|(info, _)| info).collect()
}

fn adapters() -> Vec<(DeviceInfo, wgpu::Adapter)> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    // OpenGL only where there is nothing else: there it would list the same devices again.
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    found.retain(can_compute);
    if found.is_empty() {
        found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::SECONDARY));
        found.retain(can_compute);
    }
    let describe = |(index, adapter): (usize, wgpu::Adapter)| {
        (DeviceInfo::new(index, adapter.get_info(), adapter.features()), adapter)
    };
    found.into_iter().enumerate().map(describe).collect()
}

const RAY_QUERIES: wgpu::Features = wgpu::Features::EXPERIMENTAL_RAY_QUERY;

fn can_compute(adapter: &wgpu::Adapter) -> bool {
    adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
        && missing_limit(&adapter.limits(), RENDER_BUFFERS).is_none()
}

/// Storage buffers the widest kernel of the renderer sees.
const RENDER_BUFFERS: u32 = 11;
/// The same of the search, without buffers of a custom visitor.
const SEARCH_BUFFERS: u32 = 8;
/// Bytes of workgroup memory the widest kernel uses.
const WORKGROUP_BYTES: u32 = 20 << 10;

/// Limits with which a device of one's own can be opened for [`Context::from_device`]: wgpu's defaults where they are
/// enough. Those of the adapter, where they are higher, allow more points and more buffers in a custom visitor.
pub fn required_limits() -> wgpu::Limits {
    let defaults = wgpu::Limits::default();
    wgpu::Limits {
        max_storage_buffers_per_shader_stage: defaults.max_storage_buffers_per_shader_stage.max(SEARCH_BUFFERS),
        max_compute_workgroup_storage_size: defaults.max_compute_workgroup_storage_size.max(WORKGROUP_BYTES),
        ..defaults
    }
}

/// The first of our needs that these limits do not meet.
fn missing_limit(limits: &wgpu::Limits, buffers: u32) -> Option<(&'static str, u64, u64)> {
    [
        ("storage buffers a shader", u64::from(buffers), u64::from(limits.max_storage_buffers_per_shader_stage)),
        ("bytes of workgroup memory", u64::from(WORKGROUP_BYTES), u64::from(limits.max_compute_workgroup_storage_size)),
        ("threads a workgroup", 64, u64::from(limits.max_compute_invocations_per_workgroup)),
        ("bytes in a storage binding", 1 << 27, limits.max_storage_buffer_binding_size),
    ]
    .into_iter()
    .find(|(_, needed, allowed)| allowed < needed)
}

fn check_limits(info: &DeviceInfo, limits: &wgpu::Limits, buffers: u32) -> Result<(), Error> {
    let missing = missing_limit(limits, buffers);
    missing.map_or(Ok(()), |(what, needed, allowed)| {
        Err(Error::NoDevice(format!("{info} allows {allowed} {what}, {needed} are needed")))
    })
}

/// The first that is right, else the first error; nothing of nothing.
fn first_or_first_error<T, E>(results: impl IntoIterator<Item = Result<T, E>>) -> Option<Result<T, E>> {
    let mut error = None;
    for result in results {
        match result {
            Ok(value) => return Some(Ok(value)),
            Err(why) => _ = error.get_or_insert(why),
        }
    }
    error.map(Err)
}

const TIMESTAMPS: wgpu::Features =
    wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

/// A device, and what has gone wrong with it. The GPU's errors come late and from other threads; they are kept here and
/// returned by the next [`Context::check`].
pub struct Context {
    /// The device.
    pub(super) device: wgpu::Device,
    /// Its queue.
    pub(super) queue: wgpu::Queue,
    /// Its limits.
    pub(super) limits: wgpu::Limits,
    /// Whether timestamps can be taken between passes.
    pub(super) timestamps: bool,
    pub(super) kernels: Cache,
    info: DeviceInfo,
    failure: Arc<Mutex<Option<String>>>,
    /// Bytes in buffers.
    used: Arc<AtomicU64>,
    /// Most bytes in buffers: software accepts any amount and then the machine dies.
    budget: u64,
}

impl Context {
    /// Opens a device.
    pub fn new(choice: &Choice) -> Result<Self, Error> {
        Self::choose(choice, false)
    }

    /// Opens a device, of those that have ray queries, with that feature: [`super::Method::Hardware`] needs it. It is
    /// experimental in wgpu, which says that it may have unsound bugs, so that it is only asked for here
    /// (docs/adr/0007-ray-queries.md).
    pub fn with_ray_queries(choice: &Choice) -> Result<Self, Error> {
        Self::choose(choice, true)
    }

    fn choose(choice: &Choice, ray_queries: bool) -> Result<Self, Error> {
        let mut found = adapters();
        let n_all = found.len();
        found.retain(|(info, _)| info.ray_queries || !ray_queries);
        if found.is_empty() && n_all > 0 {
            return Err(Error::NoDevice(format!("none of {n_all} GPU adapters has ray queries")));
        }
        let kind = if ray_queries { " with ray queries" } else { "" };
        let list = || {
            let names: Vec<String> = list_devices().iter().map(|d| format!("{}: {d}", d.index)).collect();
            if names.is_empty() { "there is none".to_owned() } else { format!("there are {}", names.join("; ")) }
        };
        found.sort_by_key(|(info, _)| (info.kind.rank(), info.index));
        let wanted = |info: &DeviceInfo| match choice {
            Choice::Real => info.is_real(),
            Choice::Any => true,
            Choice::Index(index) => info.index == *index,
            Choice::Name(part) => info.name.to_lowercase().contains(&part.to_lowercase()),
        };
        found.retain(|(info, _)| wanted(info));
        // A card may be there twice, by several drivers. Another one does not stand in for it.
        let best = found.first().map(|(info, _)| info.name.clone());
        let same = found.into_iter().filter(|(info, _)| Some(&info.name) == best.as_ref());
        let opened = same.map(|(info, adapter)| Self::open(info, &adapter, ray_queries));
        first_or_first_error(opened).unwrap_or_else(|| {
            Err(Error::NoDevice(match choice {
                Choice::Real => format!("no hardware GPU{kind}; {}", list()),
                Choice::Any => {
                    "no GPU adapter: no driver, or none with compute shaders (--backend cpu needs none)".to_owned()
                }
                Choice::Index(index) => format!("no GPU adapter {index}{kind}; {}", list()),
                Choice::Name(part) => format!("no GPU adapter named \"{part}\"{kind}; {}", list()),
            }))
        })
    }

    fn open(info: DeviceInfo, adapter: &wgpu::Adapter, ray_queries: bool) -> Result<Self, Error> {
        let limits = adapter.limits();
        check_limits(&info, &limits, RENDER_BUFFERS)?;
        let mut features = adapter.features() & TIMESTAMPS;
        let mut experimental_features = wgpu::ExperimentalFeatures::disabled();
        if ray_queries {
            features |= RAY_QUERIES;
            experimental_features = experimental();
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("sunfleck"),
            required_features: features,
            required_limits: limits.clone(),
            experimental_features,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| Error::Device { device: info.to_string(), message: error.to_string() })?;

        let failure = Arc::new(Mutex::new(None));
        let record = |failure: &Arc<Mutex<Option<String>>>| {
            let failure = Arc::clone(failure);
            move |message: String| {
                let mut first = failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                first.get_or_insert(message);
            }
        };
        let uncaptured = record(&failure);
        device.on_uncaptured_error(Arc::new(move |error| uncaptured(error.to_string())));
        let lost = record(&failure);
        device.set_device_lost_callback(move |reason, message| lost(format!("device lost ({reason:?}): {message}")));

        Ok(Self::with(device, queue, info, failure))
    }

    /// Takes a device that the caller has opened, and its queue; both may go on being used elsewhere.
    ///
    /// [`required_limits`] are checked here. No callback of the device is touched: what goes wrong with the work that is
    /// recorded here is caught by error scopes and returned, and only an error that wgpu raises on another thread goes to
    /// the caller's handler (or, without one, wgpu panics). The loss of the device is told to the caller's callback;
    /// here it shows as an error of whatever is read back next. Times are measured by timestamps if the device was opened
    /// with `TIMESTAMP_QUERY` and `TIMESTAMP_QUERY_INSIDE_ENCODERS`, else by waiting; ray queries can be used if it was
    /// opened with `EXPERIMENTAL_RAY_QUERY` and the adapter's limits for them.
    pub fn from_device(device: wgpu::Device, queue: wgpu::Queue) -> Result<Self, Error> {
        let info = DeviceInfo::new(usize::MAX, device.adapter_info(), device.features());
        check_limits(&info, &device.limits(), SEARCH_BUFFERS)?;
        Ok(Self::with(device, queue, info, Arc::default()))
    }

    fn with(device: wgpu::Device, queue: wgpu::Queue, info: DeviceInfo, failure: Arc<Mutex<Option<String>>>) -> Self {
        let budget = if info.is_real() { u64::MAX } else { software_budget() };
        Self {
            limits: device.limits(),
            timestamps: device.features().contains(TIMESTAMPS),
            device,
            queue,
            kernels: Cache::default(),
            info,
            failure,
            used: Arc::new(AtomicU64::new(0)),
            budget,
        }
    }

    /// The device, for buffers of the caller's own.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Its queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// What the device is.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Whether the device was opened with ray queries.
    pub fn ray_queries(&self) -> bool {
        self.device.features().contains(RAY_QUERIES)
    }

    /// Most bytes of one array that a shader can see.
    pub fn most_bytes_bound(&self) -> u64 {
        // Buffers are multiples of 16 bytes.
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size) & !15
    }

    /// Waits for the device and copies `n` elements of a buffer with usage `COPY_SRC` to the host, from a byte on that is a
    /// multiple of 4. `T` is a multiple of 4 bytes.
    pub fn download<T: bytemuck::Pod>(
        &self,
        buffer: &wgpu::Buffer,
        first_byte: u64,
        n: usize,
    ) -> Result<Vec<T>, Error> {
        if n == 0 {
            return Ok(Vec::new());
        }
        self.guarded(|| Readback::default().read_from(self, &Shared::new(self, Vec::new()), buffer, first_byte, n))
    }

    /// Bytes that may still be given to buffers.
    pub(super) fn budget_left(&self) -> u64 {
        self.budget.saturating_sub(self.used())
    }

    /// Sets the most bytes that may lie in buffers.
    pub fn set_budget(&mut self, bytes: u64) {
        self.budget = bytes;
    }

    /// Bytes in buffers.
    pub fn used(&self) -> u64 {
        self.used.load(Ordering::Relaxed)
    }

    /// Gives the device up: everything after it is an error.
    pub fn destroy(&self) {
        self.device.destroy();
    }

    /// The first thing that has gone wrong, if any has.
    pub fn check(&self) -> Result<(), Error> {
        let first = self.failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        match first.as_ref() {
            None => Ok(()),
            Some(message) => Err(self.error(message.clone())),
        }
    }

    /// An error of this device.
    pub(super) fn error(&self, message: String) -> Error {
        Error::Device { device: self.info.to_string(), message }
    }

    /// An array of `needed` bytes that may have `allowed`.
    pub(super) fn too_large(&self, what: &str, needed: u64, allowed: u64) -> Error {
        Error::TooLarge { what: what.to_owned(), needed, allowed, device: self.info.to_string() }
    }

    /// Refuses more bytes than one binding holds.
    pub(super) fn check_bound(&self, what: &str, bytes: u64) -> Result<(), Error> {
        let allowed = self.most_bytes_bound();
        if bytes > allowed { Err(self.too_large(what, bytes, allowed)) } else { Ok(()) }
    }

    /// Runs what only this thread does with the device, and returns what went wrong there.
    pub(super) fn scoped<T>(&self, work: impl FnOnce() -> T) -> Result<T, wgpu::Error> {
        let scopes = Scopes::new(&self.device);
        let result = work();
        scopes.first().map_or(Ok(result), Err)
    }

    /// The same for work that can fail in other ways too. What makes or writes anything on the device lies in one of these
    /// or in a [`super::kernels::Batch`]: a device without a handler of its own panics at what goes wrong elsewhere.
    pub(super) fn guarded<T>(&self, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        self.scoped(work).map_err(|error| self.error(error.to_string()))?
    }

    /// Waits until the device has done all it was given.
    pub(super) fn wait(&self) -> Result<(), Error> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        polled.map_err(|error| self.error(error.to_string()))?;
        Ok(())
    }

    /// Waits until the device has done this, and all before it.
    pub(super) fn wait_for(&self, submission: wgpu::SubmissionIndex) -> Result<(), Error> {
        match self.device.poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None }) {
            Ok(_) => self.check(),
            // A lost device never took it; wgpu says that it is lost only where all is waited for.
            Err(_) => self.wait(),
        }
    }

    /// A buffer of at least one byte; `bound` says how much of it one shader sees at once.
    pub(super) fn buffer(
        &self,
        what: &str,
        bytes: u64,
        bound: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<Buffer, Error> {
        let bytes = bytes.max(16).next_multiple_of(16);
        let too_large = |needed: u64, allowed: u64| self.too_large(what, needed, allowed);
        if usage.contains(wgpu::BufferUsages::STORAGE) {
            self.check_bound(what, bound)?;
        }
        if bytes > self.limits.max_buffer_size {
            return Err(too_large(bytes, self.limits.max_buffer_size));
        }
        let left = self.budget_left();
        if bytes > left {
            return Err(too_large(bytes, left));
        }
        let descriptor = wgpu::BufferDescriptor { label: Some(what), size: bytes, usage, mapped_at_creation: false };
        let raw = self.scoped(|| self.device.create_buffer(&descriptor)).map_err(|error| match error {
            wgpu::Error::OutOfMemory { .. } => too_large(bytes, left.min(self.limits.max_buffer_size)),
            other => self.error(format!("{what}: {other}")),
        })?;
        self.used.fetch_add(bytes, Ordering::Relaxed);
        Ok(Buffer { raw, used: Arc::clone(&self.used) })
    }
}

/// Catches what this thread does wrong with a device, until it is asked for or dropped.
pub(super) struct Scopes(Vec<wgpu::ErrorScopeGuard>);

impl Scopes {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let filters = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation];
        Self(filters.into_iter().map(|filter| device.push_error_scope(filter)).collect())
    }

    /// What went wrong first, if anything did.
    pub(super) fn first(mut self) -> Option<wgpu::Error> {
        let mut first = None;
        while let Some(scope) = self.0.pop() {
            first = first.or(pollster::block_on(scope.pop()));
        }
        first
    }
}

impl Drop for Scopes {
    fn drop(&mut self) {
        // The last one first: any other order is refused.
        while self.0.pop().is_some() {}
    }
}

/// A buffer that counts against the budget while it lives.
pub(super) struct Buffer {
    pub(super) raw: wgpu::Buffer,
    used: Arc<AtomicU64>,
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.used.fetch_sub(self.raw.size(), Ordering::Relaxed);
    }
}

/// What wgpu wants to hear before it gives a feature that it calls experimental.
#[allow(unsafe_code, reason = "docs/adr/0007-ray-queries.md")]
fn experimental() -> wgpu::ExperimentalFeatures {
    // SAFETY: nothing to uphold; the call says that such features may have unsound bugs, which are wgpu's to mend and
    // ours to report. The user has asked for them.
    unsafe { wgpu::ExperimentalFeatures::enabled() }
}

/// Half of the memory that is free, where the system says, else 4 GiB.
fn software_budget() -> u64 {
    let available = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
        line.split_whitespace().nth(1)?.parse::<u64>().ok()
    });
    available.map_or(4 << 30, |kib| kib * 1024 / 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adapters_are_tried_until_one_opens_and_the_first_error_is_told() {
        let first = |opens: fn(u32) -> Result<u32, u32>, n| first_or_first_error((0..n).map(opens));
        let second = |i| match i {
            0 => Err(i),
            1 => Ok(i),
            _ => panic!("opened though there is one"),
        };
        assert_eq!(first(second, 3), Some(Ok(1)));
        assert_eq!(first(Err, 3), Some(Err(0)));
        assert_eq!(first(Ok, 0), None);
    }
}
