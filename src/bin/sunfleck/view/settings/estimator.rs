//! How the light is computed.

use eframe::egui;
use egui::Ui;
use sunfleck::ppm::Params;
use sunfleck::scene::Accelerator;
use sunfleck::scene::settings::{Count, Direct, FirstRadius, Index, Kernel, Settings, is_alpha};

use super::number::{NO_LIMIT, Number, log_slider, metres, rounded, slider, whole};
use super::widgets::{Name, choice, row};
use super::{Said, setting};
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

    let photons = |ui: &mut Ui, photons: &mut Count| {
        let mut n = f64::from(photons.0);
        let response = log_slider(ui, &mut n, Number::Count, 1e3..=2e7);
        if response.changed() {
            let n = if response.dragged() { rounded(n) } else { n };
            *photons = Count(n.clamp(1.0, f64::from(u32::MAX)) as u32);
        }
        response
    };
    setting(ui, viewer, PHOTONS, photons_of(now, read), photons, |s, photons| s.photons = photons);

    let said = Said { now: now.alpha, read: read.alpha, default: defaults.alpha };
    let alpha = |ui: &mut Ui, alpha: &mut f32| {
        let mut shown = f64::from(*alpha);
        let response = slider(ui, &mut shown, Number::Plain, 0.01..=0.99);
        // Typed, it may be anything.
        *alpha = Some(shown as f32).filter(|&shown| is_alpha(shown)).unwrap_or(*alpha);
        response
    };
    setting(ui, viewer, ALPHA, said, alpha, |s, alpha| s.alpha = alpha);

    radius(ui, viewer, read, now);

    pick(ui, viewer, KERNEL, &KERNELS, [now.kernel, read.kernel], |s, kernel| s.kernel = kernel);
    pick(ui, viewer, DIRECT, &DIRECTS, [now.direct, read.direct], |s, direct| s.direct = direct);
    numbers(ui, viewer, read, now);

    let indices = if viewer.engine().has_ray_queries() { &INDICES[..] } else { &INDICES[..1] };
    pick(ui, viewer, INDEX, indices, [now.index, read.index], |s, index| s.index = index);
    let accelerators = if viewer.engine().backend() == "cpu" { &ACCELERATORS[..] } else { &ACCELERATORS[..1] };
    pick(ui, viewer, ACCELERATOR, accelerators, [now.accel, read.accel], |s, accel| s.accel = accel);
}

fn photons_of(now: &Settings, read: &Settings) -> Said<Count> {
    Said { now: now.photons, read: read.photons, default: Count(Params::new(1, 1).n_paths) }
}

impl Viewer {
    /// Photons emitted an iteration, times a factor.
    pub fn scale_photons(&mut self, ui: &Ui, factor: f64) {
        let Some(opened) = self.opened().cloned() else { return };
        let said = photons_of(&self.settings(), &opened.read());
        let photons = said.saying(Count((factor * f64::from(said.value().0)).max(1.0) as u32));
        self.edit(ui, PHOTONS.name, |s| s.photons = photons);
    }
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
    let control = |ui: &mut Ui, value: &mut T| {
        let mut shown = Some(*value).filter(is_listed).unwrap_or(all[0].0);
        let response = ui.add_enabled_ui(all.len() > 1, |ui| choice(ui, name.name, &mut shown, all)).inner;
        if response.changed() {
            *value = shown;
        }
        response
    };
    setting(ui, viewer, name, Said { now, read, default: all[0].0 }, control, set);
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
        let said = Said { now: now.radius, read: read.radius, default: FirstRadius::Automatic };
        let radius = said.saying(fixed.map_or(FirstRadius::Automatic, FirstRadius::Fixed));
        viewer.edit(ui, "radius", |s| s.radius = radius);
    }
    if reset {
        viewer.reset(ui, |s| s.radius = read.radius);
    }
}

/// The longest path and the seed.
fn numbers(ui: &mut Ui, viewer: &mut Viewer, read: &Settings, now: &Settings) {
    let size = |ui: &Ui| egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
    let longest = |ui: &mut Ui, longest: &mut u32| {
        let drag = egui::DragValue::new(longest).speed(1.0).range(0..=u32::MAX);
        let drag = drag.custom_formatter(|n, _| if n < 0.5 { NO_LIMIT.to_owned() } else { format!("{n:.0}") });
        whole(ui, size(ui), drag)
    };
    let said = Said { now: now.max_segments, read: read.max_segments, default: 0 };
    setting(ui, viewer, LONGEST, said, longest, |s, longest| s.max_segments = longest.filter(|&n| n > 0));

    let seed = |ui: &mut Ui, seed: &mut u32| whole(ui, size(ui), egui::DragValue::new(seed).speed(1.0));
    setting(ui, viewer, SEED, Said { now: now.seed, read: read.seed, default: 0 }, seed, |s, seed| s.seed = seed);
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
