//! How the light is computed.

use eframe::egui;
use egui::Ui;
use sunfleck::ppm::Params;
use sunfleck::scene::Accelerator;
use sunfleck::scene::settings::{Count, Direct, FirstRadius, Index, Kernel, Settings, is_alpha};

use super::number::{NO_LIMIT, Number, log_slider, metres, rounded, slider, whole};
use super::widgets::{Name, choice, row};
use crate::view::app::Viewer;

const PHOTONS: Name = Name {
    name: "Photons",
    hint: "Photons emitted an iteration: 500k, 1.5M. More of them make an iteration slower and its picture less noisy. \
           Restarts the estimate.",
};
const ALPHA: Name = Name {
    name: "Alpha",
    hint: "α of Knaus & Zwicker, between 0 and 1: how slowly the radius shrinks. Smaller values lose blur sooner and \
           noise later. Restarts the estimate.",
};
const RADIUS: Name = Name {
    name: "First radius",
    hint: "Distance within which the first iteration gathers photons: found for every pixel, or the same everywhere, \
           metres. Restarts the estimate.",
};
const FIXED_RADIUS: Name =
    Name { name: "", hint: "First radius, metres; 5 mm can be typed, too. Restarts the estimate." };
const KERNEL: Name =
    Name { name: "Kernel", hint: "How a photon's weight falls with its distance. Restarts the estimate." };
const DIRECT: Name =
    Name { name: "Direct light", hint: "Who brings the light straight from a lamp. Restarts the estimate." };
const LONGEST: Name = Name {
    name: "Longest path",
    hint: "Segments from lamp to lens, at most; what is longer is left out, which darkens the picture. 0: no limit. \
           Restarts the estimate.",
};
const SEED: Name =
    Name { name: "Seed", hint: "Another seed, other noise; the same seed, the same picture. Restarts the estimate." };
const INDEX: Name = Name {
    name: "Index",
    hint: "What finds the photons near a point: a GPU with ray queries has a choice. The picture converges to the same. \
           Kept in the settings; a device without the choice goes by the tree. Restarts the estimate.",
};
const ACCELERATOR: Name = Name {
    name: "Accelerator",
    hint: "What finds the surface a ray meets: the CPU has a choice. The picture is the same. Kept in the settings; a GPU \
           goes by boxes. Restarts the estimate.",
};

/// Values, the default first; names and hints.
type Values<T> = [(T, &'static str, &'static str); 2];

const KERNELS: Values<Kernel> = [
    (Kernel::Epanechnikov, "Epanechnikov", "Falls to nothing at the radius: less blur."),
    (Kernel::Constant, "Constant", "The same everywhere within the radius."),
];
const DIRECTS: Values<Direct> = [
    (Direct::Sampled, "Sampled", "Lamps are sampled where the eye path ends: sharp shadows at once."),
    (Direct::Photons, "Photons", "Photons bring all light, as in the literature."),
];
const INDICES: Values<Index> = [
    (Index::Tree, "Tree", "Sunfleck's own tree over the photons."),
    (Index::Hardware, "Ray queries", "The ray tracing hardware of the graphics card."),
];
const ACCELERATORS: Values<Accelerator> =
    [(Accelerator::Bvh, "Boxes (bvh)", "A bounding volume hierarchy."), (Accelerator::Kd, "Planes (kd)", "A kd-tree.")];

pub fn show(ui: &mut Ui, viewer: &mut Viewer, read: &Settings) {
    let now = &*viewer.settings();
    let defaults = Params::new(1, 1);

    let mut photons = f64::from(now.photons.map_or(defaults.n_paths, |n| n.0));
    let mut changed = None;
    let reset = row(ui, PHOTONS, now.photons != read.photons, |ui| {
        let response = log_slider(ui, &mut photons, Number::Count, 1e3..=2e7);
        if response.changed() {
            let n = if response.dragged() { rounded(photons) } else { photons };
            changed = Some(n.clamp(1.0, f64::from(u32::MAX)) as u32);
        }
        response
    });
    if let Some(n) = changed {
        viewer.edit(ui, "photons", |s| s.photons = Some(Count(n)));
    }
    if reset {
        viewer.reset(ui, |s| s.photons = read.photons);
    }

    let mut alpha = f64::from(now.alpha.unwrap_or(defaults.alpha));
    let mut changed = false;
    let reset = row(ui, ALPHA, now.alpha != read.alpha, |ui| {
        let response = slider(ui, &mut alpha, Number::Plain, 0.01..=0.99);
        changed = response.changed();
        response
    });
    if changed && is_alpha(alpha as f32) {
        viewer.edit(ui, "alpha", |s| s.alpha = Some(alpha as f32));
    }
    if reset {
        viewer.reset(ui, |s| s.alpha = read.alpha);
    }

    radius(ui, viewer, read, now);

    pick(ui, viewer, KERNEL, &KERNELS, [now.kernel, read.kernel], |s, kernel| s.kernel = kernel);
    pick(ui, viewer, DIRECT, &DIRECTS, [now.direct, read.direct], |s, direct| s.direct = direct);
    numbers(ui, viewer, read, now);

    let indices = if viewer.engine().has_ray_queries() { &INDICES[..] } else { &INDICES[..1] };
    pick(ui, viewer, INDEX, indices, [now.index, read.index], |s, index| s.index = index);
    let accelerators = if viewer.engine().backend() == "cpu" { &ACCELERATORS[..] } else { &ACCELERATORS[..1] };
    pick(ui, viewer, ACCELERATOR, accelerators, [now.accel, read.accel], |s, accel| s.accel = accel);
}

/// One of a list, the default first: also what is shown if it is none of them, as the file of another device may ask.
fn pick<T: Copy + PartialEq>(
    ui: &mut Ui,
    viewer: &mut Viewer,
    name: Name,
    all: &[(T, &str, &str)],
    [now, read]: [Option<T>; 2],
    set: fn(&mut Settings, Option<T>),
) {
    let is_listed = |value: &T| all.iter().any(|(listed, ..)| listed == value);
    let mut value = now.filter(is_listed).unwrap_or(all[0].0);
    let mut changed = false;
    let reset = row(ui, name, now != read, |ui| {
        let response = ui.add_enabled_ui(all.len() > 1, |ui| choice(ui, name.name, &mut value, all)).inner;
        changed = response.changed();
        response
    });
    if changed {
        viewer.edit(ui, name.name, |s| set(s, Some(value)));
    }
    if reset {
        viewer.reset(ui, |s| set(s, read));
    }
}

fn radius(ui: &mut Ui, viewer: &mut Viewer, read: &Settings, now: &Settings) {
    let mut fixed = match now.radius {
        Some(FirstRadius::Fixed(radius)) => Some(radius),
        _ => None,
    };
    let mut is_fixed = fixed.is_some();
    let mut changed = false;
    let reset = row(ui, RADIUS, now.radius != read.radius, |ui| {
        let all = [
            (false, "Automatic", "One for every pixel, from its size and the photons near it."),
            (true, "Fixed", "The same everywhere, metres."),
        ];
        let response = choice(ui, "radius", &mut is_fixed, &all);
        changed = response.changed();
        response
    });
    if changed {
        // Begins with what the automatic ones are like.
        let automatic = viewer.now.snapshot.as_ref().map(|snapshot| snapshot.first_radius).filter(|r| *r > 0.0);
        fixed = is_fixed.then(|| short(automatic.unwrap_or(0.01)));
    }
    let size = viewer.scene_size();
    if let Some(radius) = &mut fixed {
        row(ui, FIXED_RADIUS, false, |ui| {
            let response = metres(ui, radius, 1e-9, size);
            changed |= response.changed();
            response
        });
    }
    if changed {
        let radius = fixed.map_or(FirstRadius::Automatic, FirstRadius::Fixed);
        viewer.edit(ui, "radius", |s| s.radius = Some(radius));
    }
    if reset {
        viewer.reset(ui, |s| s.radius = read.radius);
    }
}

/// The longest path and the seed.
fn numbers(ui: &mut Ui, viewer: &mut Viewer, read: &Settings, now: &Settings) {
    let mut longest = now.max_segments.unwrap_or(0);
    let mut changed = false;
    let reset = row(ui, LONGEST, now.max_segments != read.max_segments, |ui| {
        let drag = egui::DragValue::new(&mut longest).speed(1.0).range(0..=u32::MAX);
        let drag = drag.custom_formatter(|n, _| if n < 0.5 { NO_LIMIT.to_owned() } else { format!("{n:.0}") });
        let response = whole(ui, egui::vec2(ui.available_width(), ui.spacing().interact_size.y), drag);
        changed = response.changed();
        response
    });
    if changed {
        viewer.edit(ui, "longest path", |s| s.max_segments = (longest > 0).then_some(longest));
    }
    if reset {
        viewer.reset(ui, |s| s.max_segments = read.max_segments);
    }

    let mut seed = now.seed.unwrap_or(0);
    let mut changed = false;
    let reset = row(ui, SEED, now.seed != read.seed, |ui| {
        let drag = egui::DragValue::new(&mut seed).speed(1.0);
        let response = whole(ui, egui::vec2(ui.available_width(), ui.spacing().interact_size.y), drag);
        changed = response.changed();
        response
    });
    if changed {
        viewer.edit(ui, "seed", |s| s.seed = Some(seed));
    }
    if reset {
        viewer.reset(ui, |s| s.seed = read.seed);
    }
}

/// To two significant digits.
fn short(x: f32) -> f32 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    #[test]
    fn radii_begin_short() {
        assert_eq!(super::short(0.012_345), 0.012);
        assert_eq!(super::short(3.0), 3.0);
    }
}
