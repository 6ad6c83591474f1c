//! Devices of the caller's own, and devices that lack something.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use sunfleck::device::Error;
use sunfleck::gpu::{Access, Choice, Context, PointSearch, Queries, required_limits, wgpu};
use sunfleck::index::Radii;

use super::visitors::KERNEL_SUM;
use super::{ALL, assert_same_sets, context, is_exact, queries, uniform, upload};

/// A device that this test has opened itself, with the limits that are asked for; its handler counts what reaches it.
fn own_device() -> Option<(wgpu::Device, wgpu::Queue, Arc<AtomicUsize>)> {
    context()?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).ok()?;
    let descriptor = wgpu::DeviceDescriptor { required_limits: required_limits(), ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
    let n_errors = Arc::new(AtomicUsize::new(0));
    let counter = Arc::clone(&n_errors);
    device.on_uncaptured_error(Arc::new(move |_| {
        counter.fetch_add(1, Ordering::Relaxed);
    }));
    Some((device, queue, n_errors))
}

#[test]
fn a_device_of_ones_own() {
    let Some((device, queue, n_errors)) = own_device() else { return };
    let context = Arc::new(Context::from_device(device.clone(), queue).expect("enough"));
    assert_eq!(context.info().name, device.adapter_info().name);
    let mut search = PointSearch::new(context.clone()).expect("kernels");
    let (points, exact) = (uniform(80, 1000), is_exact(&search));
    search.build(&points).expect("build");
    let (queries, radii) = queries(&points, 100);
    let found = search.neighbours_all(&queries, Radii::Each(&radii)).expect("search");
    assert_same_sets("own device", &points, &queries, Radii::Each(&radii), &found, exact);

    // Errors come back here, and only here.
    assert!(matches!(search.compile("fn begin(", &[]), Err(Error::Shader(_))));
    let visitor = search.compile(KERNEL_SUM, &[Access::Read, Access::Write]).expect("it compiles");
    let plain = upload(&context, &radii, wgpu::BufferUsages::UNIFORM);
    let unbindable = search.visit_all(&visitor, Queries::Host(&queries), ALL.into(), &[&plain, &plain]);
    assert!(matches!(unbindable, Err(Error::Device { .. })), "{unbindable:?}");
    search.count_all(&queries, ALL).expect("it goes on");
    assert_eq!(n_errors.load(Ordering::Relaxed), 0);

    device.destroy();
    let lost = search.build(&points).and_then(|()| search.count_all(&queries, ALL));
    assert!(matches!(lost, Err(Error::Device { .. })), "{lost:?}");
}

#[test]
fn a_device_of_ones_own_with_too_little() {
    if context().is_none() {
        return;
    }
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).expect("an adapter");
    let limits = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..wgpu::Limits::downlevel_defaults() };
    let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
    match Context::from_device(device, queue) {
        Err(Error::NoDevice(message)) => assert!(message.contains("4 storage buffers"), "{message}"),
        other => panic!("{:?}", other.map(drop)),
    }
}

/// A device of one's own whose limits are `change`d for the worse. It has no handler: what reaches it panics.
pub fn meagre_device(change: impl FnOnce(&mut wgpu::Limits)) -> Option<Arc<Context>> {
    context()?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).expect("an adapter");
    let mut required_limits = required_limits();
    change(&mut required_limits);
    let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
    Some(Arc::new(Context::from_device(device, queue).expect("what is checked there is enough")))
}

/// Not even the small things that every search has can be made.
#[test]
fn what_a_device_of_ones_own_refuses_is_an_error() {
    let no_buffers = |limits: &mut wgpu::Limits| limits.max_buffer_size = 4096;
    let no_uniforms = |limits: &mut wgpu::Limits| limits.max_uniform_buffer_binding_size = 64;
    let changes: [&dyn Fn(&mut wgpu::Limits); 2] = [&no_buffers, &no_uniforms];
    for change in changes {
        let Some(context) = meagre_device(change) else { return };
        let made = PointSearch::new(Arc::clone(&context)).map(drop);
        assert!(matches!(made, Err(Error::Device { .. })), "{made:?}");
        let data = upload(&context, &[1.0f32; 4], wgpu::BufferUsages::STORAGE);
        let read = context.download::<f32>(&data, 0, 4);
        assert!(matches!(read, Err(Error::Device { .. })), "{read:?}");
    }
}

/// What a device cannot hold at once is searched in parts where the rows end on the host, and refused where not.
#[test]
fn more_than_fits() {
    if context().is_none() {
        return;
    }
    let mut context = Context::new(&Choice::Any).expect("a second device");
    context.set_budget(4 << 20);
    let mut search = PointSearch::new(Arc::new(context)).expect("kernels");
    let points = uniform(60, 2000);
    search.build(&points).expect("within the budget");
    let (queries, _) = queries(&points, 300);
    let found = search.neighbours_all(&queries, ALL).expect("in parts");
    let exact = is_exact(&search);
    assert_same_sets("in parts", &points, &queries, ALL, &found, exact);
    assert_eq!(found.indices.len(), 600_000);
    match search.neighbours_on_device(Queries::Host(&queries), ALL.into()) {
        Err(Error::TooLarge { needed, allowed, .. }) => assert!((needed, allowed < 4 << 20) == (2_400_000, true)),
        other => panic!("{:?}", other.map(drop)),
    }
    match search.build(&uniform(61, 300_000)) {
        Err(Error::TooLarge { what, needed, .. }) => {
            assert!(what.starts_with("points") && needed > 16 * 300_000, "{what}: {needed}");
        }
        other => panic!("{other:?}"),
    }
    assert!(search.is_empty() && search.count_all(&queries, ALL).expect("no points").iter().all(|n| *n == 0));
}
