//! From a film to what the window shows.

use std::sync::{Arc, Weak};

use anyhow::Result;
use eframe::egui::ColorImage;
use sunfleck::inspect::{self, ColorBy, FirstHits};
use sunfleck::layout::Photon;
use sunfleck::output::Picture;
use sunfleck::output::compare::{Difference, compare};
use sunfleck::output::convergence::Halves;
use sunfleck::output::difference::{self, Measure};
use sunfleck::output::display::{self, Look};
use sunfleck::output::false_colour::{self, Scale};
use sunfleck::output::flip::{self, flip};
use sunfleck::output::histogram::Histogram;
use sunfleck::output::tonemap::{self, ToneMap, srgb_encode};

use super::colours::{Colours, Legend, Values, far, image, in_false_colour, on_display, plain, reduced, scalar, stops};
use super::{Reference, Snapshot};

/// What is shown of a render.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    #[default]
    Picture,
    /// Luminance in stops about mid grey, in false colour.
    Stops,
    Direct,
    Caustic,
    Indirect,
    Albedo,
    Normal,
    Depth,
    PhotonCount,
    Radius,
    Variance,
    NodesVisited,
}

impl View {
    pub const ALL: [Self; 12] = [
        Self::Picture,
        Self::Stops,
        Self::Direct,
        Self::Caustic,
        Self::Indirect,
        Self::Albedo,
        Self::Normal,
        Self::Depth,
        Self::PhotonCount,
        Self::Radius,
        Self::Variance,
        Self::NodesVisited,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Picture => "Picture",
            Self::Stops => "False colour",
            Self::Direct => "Direct light",
            Self::Caustic => "Caustics",
            Self::Indirect => "Indirect light",
            Self::Albedo => "Albedo",
            Self::Normal => "Normal",
            Self::Depth => "Depth",
            Self::PhotonCount => "Gathered photons",
            Self::Radius => "Radius",
            Self::Variance => "Variance",
            Self::NodesVisited => "Nodes visited",
        }
    }

    /// For people.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Picture => "what is rendered",
            Self::Stops => "luminance in stops about mid grey, after exposure",
            Self::Direct => "what the eye path finds, and the light sampled at its end",
            Self::Caustic => "photons that met only mirrors and glass since the lamp",
            Self::Indirect => "all other photons",
            Self::Albedo => "base colour of what is seen first",
            Self::Normal => "shading normal of what is seen first, world space",
            Self::Depth => "distance of what is seen first along the view, metres",
            Self::PhotonCount => "photons in a pixel's estimate, mean over iterations",
            Self::Radius => "radius of the estimate, metres",
            Self::Variance => "estimated variance of the pixel's mean luminance",
            Self::NodesVisited => "nodes of the tree entered to gather a pixel",
        }
    }

    /// What it is made from beside the film.
    pub fn needs(self) -> Needs {
        Needs {
            split: matches!(self, Self::Direct | Self::Caustic | Self::Indirect | Self::PhotonCount),
            nodes_visited: self == Self::NodesVisited,
            photons: false,
        }
    }
}

/// How the picture is set beside the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Comparison {
    #[default]
    Off,
    /// The reference right of a line; the window draws it.
    Wipe,
    Difference(Measure),
    /// FLIP, of both as they are shown.
    Flip,
}

/// Of an iteration, read back from the device: as much as was needed.
#[derive(Debug, Default)]
pub struct Insides {
    pub photons: Vec<Photon>,
    pub split: Option<inspect::Split>,
    pub nodes_visited: Option<Vec<u32>>,
}

/// What of an iteration is needed. The photons alone are quick to have; the others gather again, on the processor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    pub photons: bool,
    pub split: bool,
    pub nodes_visited: bool,
}

impl Needs {
    /// Whether all of it is `there`.
    pub fn are_met_by(self, there: Self) -> bool {
        (!self.photons || there.photons) && (!self.split || there.split) && (!self.nodes_visited || there.nodes_visited)
    }

    pub fn is_any(self) -> bool {
        self != Self::default()
    }
}

impl Insides {
    /// What there is.
    pub fn has(&self) -> Needs {
        Needs { photons: true, split: self.split.is_some(), nodes_visited: self.nodes_visited.is_some() }
    }
}

/// What of `Wanted` a painting depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Painting {
    pub look: Look,
    pub view: View,
    pub comparison: Comparison,
    /// Where the colours of each [`Measure`] end, in its own unit, above 0; automatic if none
    /// ([`difference::Image::automatic_end`]).
    pub ends: [Option<f32>; Measure::ALL.len()],
    /// Photons drawn over the picture.
    pub photons: Option<ColorBy>,
    /// Those that something hides too: behind glass, in the next room.
    pub hidden_photons: bool,
}

impl Painting {
    /// What it is made from beside the film; the view needs nothing where a difference `hides` it.
    pub fn needs(&self, hides: bool) -> Needs {
        let of_view = if hides { Needs::default() } else { self.view.needs() };
        Needs { photons: self.photons.is_some(), ..of_view }
    }
}

/// A picture for the window.
#[derive(Debug)]
pub struct Painted {
    /// Pixels.
    pub size: [usize; 2],
    /// Opaque; as the texture is made from it, so that the interface hands it on and copies nothing.
    pub image: Arc<ColorImage>,
    /// What it was made from.
    pub snapshot: Arc<Snapshot>,
    pub painting: Painting,
    /// Stops; found automatically if the look has none.
    pub exposure: f32,
    pub values: Values,
    pub legend: Option<Legend>,
    pub histogram: Histogram,
    /// The reference as the picture is shown.
    pub reference: Option<(Arc<Reference>, Arc<ColorImage>)>,
    /// Least and greatest power of the photons that are drawn by power, W before the division by the number of paths.
    pub powers: Option<[f32; 2]>,
    /// Mean of the comparison that is shown.
    pub mean: Option<f64>,
    /// The film against the reference; none of a preview.
    pub figures: Option<Difference>,
    /// Why what was wanted could not be painted.
    pub problem: Option<String>,
    /// In the place of what is too large for a texture.
    pub reduced: Option<Reduced>,
}

/// A picture with fewer pixels, for a window whose textures are small.
#[derive(Debug)]
pub struct Reduced {
    pub image: Arc<ColorImage>,
    /// The reference, as small.
    pub reference: Option<Arc<ColorImage>>,
}

impl Painted {
    /// What fits into a texture.
    pub fn texture(&self) -> &Arc<ColorImage> {
        self.reduced.as_ref().map_or(&self.image, |reduced| &reduced.image)
    }

    /// The same of the reference, whose size is the picture's.
    pub fn reference_texture(&self) -> Option<&Arc<ColorImage>> {
        let (_, image) = self.reference.as_ref()?;
        self.reduced.as_ref().map_or(Some(image), |reduced| reduced.reference.as_ref())
    }

    /// The comparison that is shown in the place of the view, if one is.
    pub fn difference(&self) -> Option<Comparison> {
        let is_painted = self.reference.is_some() && self.problem.is_none();
        let beside = matches!(self.painting.comparison, Comparison::Off | Comparison::Wipe);
        (is_painted && !beside).then_some(self.painting.comparison)
    }

    /// Whether something is shown without what an iteration has to give to it first.
    pub fn lacks(&self) -> bool {
        !self.painting.needs(self.difference().is_some()).are_met_by(self.snapshot.has())
    }

    pub fn reduce(&mut self, most_side: Option<usize>) {
        let Some(most) = most_side.filter(|&most| self.size.iter().any(|&side| side > most)) else { return };
        let small = |image: &ColorImage| Arc::new(reduced(image, most));
        let reference = self.reference.as_ref().map(|(_, image)| small(image));
        self.reduced = Some(Reduced { image: small(&self.image), reference });
    }

    /// Of a pixel: red, green and blue, or one number.
    pub fn value(&self, x: usize, y: usize) -> Vec<f32> {
        let i = y * self.size[0] + x;
        match &self.values {
            Values::Rgb(values) => values.get(i).map(|v| v.to_vec()).unwrap_or_default(),
            Values::Scalar(values) => values.get(i).map(|&v| vec![v]).unwrap_or_default(),
        }
    }

    /// The same of the reference, as it is shown.
    pub fn reference_value(&self, x: usize, y: usize) -> Vec<f32> {
        let rgb = self.reference.as_ref().and_then(|(of, _)| of.picture.rgb.get(y * self.size[0] + x));
        match (rgb, self.painting.view) {
            (Some(&rgb), View::Stops) => vec![stops(rgb, self.exposure)],
            (rgb, _) => rgb.map(|rgb| rgb.to_vec()).unwrap_or_default(),
        }
    }
}

/// The reference, if it has the picture's size.
pub fn fitting<'a>(reference: Option<&'a Arc<Reference>>, snapshot: &Snapshot) -> Option<&'a Arc<Reference>> {
    reference.filter(|r| (r.picture.size, r.picture.crop) == (snapshot.params.size, snapshot.params.crop))
}

/// From the automatic exposure of a preview to the one it is shown with, stops.
const MOST_OFF: f32 = 0.25;

/// What is kept from one snapshot to the next.
#[derive(Default)]
pub struct Painter {
    halves: (u64, Halves),
    /// Automatic, of what was painted last; stops.
    exposure: Option<f32>,
    hits: Option<(Arc<Snapshot>, FirstHits)>,
    reference: Option<ReferenceImage>,
    measured: Option<AgainstReference>,
}

/// How far a film is from a reference.
struct AgainstReference {
    film: Weak<Snapshot>,
    reference: Weak<Reference>,
    difference: Result<Difference, String>,
}

/// A reference as it is shown.
struct ReferenceImage {
    of: Arc<Reference>,
    exposure: f32,
    tonemap: ToneMap,
    in_stops: bool,
    image: Arc<ColorImage>,
}

impl Painter {
    pub fn is_empty(&self) -> bool {
        let keeps_none = self.hits.is_none() && self.reference.is_none() && self.exposure.is_none();
        keeps_none && self.halves.1 == Halves::default()
    }

    /// Error estimated from the halves, and measured against the reference, or why it cannot be.
    pub fn measure(
        &mut self,
        snapshot: &Arc<Snapshot>,
        reference: Option<&Arc<Reference>>,
    ) -> (Option<f64>, Option<Result<Difference, String>>) {
        // What another scene left would keep that scene in memory.
        self.hits = self.hits.take().filter(|(of, _)| Arc::ptr_eq(&of.scene, &snapshot.scene));
        if snapshot.is_preview {
            return (None, None);
        }
        if self.halves.0 != snapshot.estimate {
            self.halves = (snapshot.estimate, Halves::default());
        }
        self.halves.1.add(&snapshot.film);
        let measured = fitting(reference, snapshot).map(|reference| self.difference(snapshot, reference));
        (self.halves.1.rel_mse(), measured)
    }

    /// Once for each film: it is painted again for every change of its look.
    fn difference(&mut self, snapshot: &Arc<Snapshot>, reference: &Arc<Reference>) -> Result<Difference, String> {
        let is_it = |of: &&AgainstReference| {
            (of.film.as_ptr(), of.reference.as_ptr()) == (Arc::as_ptr(snapshot), Arc::as_ptr(reference))
        };
        if let Some(of) = self.measured.as_ref().filter(is_it) {
            return of.difference.clone();
        }
        let difference = compare(&snapshot.picture(), &reference.picture);
        let (film, reference) = (Arc::downgrade(snapshot), Arc::downgrade(reference));
        self.measured = Some(AgainstReference { film, reference, difference: difference.clone() });
        difference
    }

    pub fn paint(
        &mut self,
        snapshot: &Arc<Snapshot>,
        reference: Option<Arc<Reference>>,
        painting: Painting,
    ) -> Painted {
        let picture = snapshot.picture();
        let exposure = painting.look.exposure.unwrap_or_else(|| self.automatic_exposure(snapshot, &picture));
        let reference = self.reference(fitting(reference.as_ref(), snapshot), painting, exposure);
        let histogram = Histogram::of(&picture.rgb, exposure);
        let mut problem = None;
        let compared = reference.as_ref().and_then(|(reference, _)| {
            let done = compared(&picture, &reference.picture, &painting, exposure).transpose()?;
            done.map_err(|error| problem = Some(error)).ok()
        });
        let mut colours = match compared {
            Some(colours) => colours,
            None => self.view(snapshot, picture, painting, exposure),
        };
        let mut powers = None;
        if let (Some(color), Some(insides)) = (painting.photons, &snapshot.insides) {
            powers = (color == ColorBy::Power).then(|| inspect::power_range(&insides.photons));
            let style = inspect::Style { color, through: painting.hidden_photons, ..Default::default() };
            let dots = inspect::draw(&insides.photons, self.hits(snapshot), &style);
            for (to, from) in colours.rgba.chunks_exact_mut(4).zip(&dots) {
                if from[3] > 0 {
                    to[..3].copy_from_slice(&from[..3]);
                }
            }
        }
        let size = snapshot.params.film_size().map(|n| n as usize);
        Painted {
            size,
            image: Arc::new(image(size, &colours.rgba)),
            snapshot: Arc::clone(snapshot),
            painting,
            exposure,
            values: colours.values,
            legend: colours.legend,
            histogram,
            reference,
            powers,
            mean: colours.mean,
            figures: None,
            problem,
            reduced: None,
        }
    }

    /// That of a preview stays where it was, as far as it can: few pixels and photons would make it flicker as the camera moves.
    fn automatic_exposure(&mut self, snapshot: &Snapshot, picture: &Picture) -> f32 {
        let own = tonemap::automatic_exposure(&picture.rgb);
        let shown = match self.exposure {
            Some(before) if snapshot.is_preview => before.clamp(own - MOST_OFF, own + MOST_OFF),
            _ => own,
        };
        self.exposure = Some(shown);
        shown
    }

    /// The reference as the picture is shown; made again only where that has changed.
    fn reference(
        &mut self,
        reference: Option<&Arc<Reference>>,
        painting: Painting,
        exposure: f32,
    ) -> Option<(Arc<Reference>, Arc<ColorImage>)> {
        let (tonemap, in_stops) = (painting.look.tonemap, painting.view == View::Stops);
        let before = self.reference.take();
        let reference = reference?;
        let is_same = |before: &ReferenceImage| {
            Arc::ptr_eq(&before.of, reference)
                && (before.exposure, before.tonemap, before.in_stops) == (exposure, tonemap, in_stops)
        };
        let now = before.filter(is_same).unwrap_or_else(|| {
            let rgba = match in_stops {
                true => in_false_colour(&reference.picture, exposure),
                false => on_display(&reference.picture, exposure, tonemap),
            };
            let size = reference.picture.crop_size();
            ReferenceImage { of: Arc::clone(reference), exposure, tonemap, in_stops, image: image(size, &rgba).into() }
        });
        let image = Arc::clone(&now.image);
        self.reference = Some(now);
        Some((Arc::clone(reference), image))
    }

    fn view(&mut self, snapshot: &Arc<Snapshot>, picture: Picture, painting: Painting, exposure: f32) -> Colours {
        let split = snapshot.insides.as_ref().and_then(|insides| insides.split.as_ref());
        let part = |pick: fn(&inspect::Parts) -> [f32; 3]| {
            split.map(|split| split.pixels.iter().map(pick).collect::<Vec<_>>())
        };
        let as_picture = |rgb: Vec<[f32; 3]>| {
            let picture = Picture { rgb, size: snapshot.params.size, crop: snapshot.params.crop, variance: None };
            Colours::of_picture(picture, exposure, painting.look.tonemap)
        };
        // Until the first iteration with photons has been read back, the picture stands for them.
        let lit = |rgb: Option<Vec<[f32; 3]>>, picture: Picture| as_picture(rgb.unwrap_or(picture.rgb));
        match painting.view {
            View::Picture => as_picture(picture.rgb),
            View::Stops => Colours::of_stops(&picture, exposure),
            View::Direct => lit(part(|p| p.direct), picture),
            View::Caustic => lit(part(|p| p.caustic), picture),
            View::Indirect => lit(part(|p| p.indirect), picture),
            View::Albedo => plain(self.hits(snapshot).base_colors(), |rgb| rgb.map(srgb_encode)),
            // As in normal maps; black where nothing is hit.
            View::Normal => plain(self.hits(snapshot).normals(), |n| match n {
                [0.0, 0.0, 0.0] => n,
                _ => n.map(|c| 0.5 * c + 0.5),
            }),
            View::Depth => {
                let mut colours = scalar(self.hits(snapshot).depths(), false);
                far(&mut colours);
                colours
            }
            View::PhotonCount => match split {
                Some(split) => scalar(split.pixels.iter().map(|p| p.gathered).collect(), true),
                None => as_picture(picture.rgb),
            },
            View::NodesVisited => match snapshot.insides.as_ref().and_then(|insides| insides.nodes_visited.as_ref()) {
                Some(nodes) => scalar(nodes.iter().map(|&n| n as f32).collect(), false),
                None => as_picture(picture.rgb),
            },
            View::Radius => {
                let scale = snapshot.radius / snapshot.first_radius.max(f32::MIN_POSITIVE);
                let radii = snapshot.first_radii.each.iter().zip(&snapshot.first_radii.gathers);
                scalar(radii.map(|(r, &gathers)| if gathers { r * scale } else { 0.0 }).collect(), true)
            }
            // One iteration has none.
            View::Variance if snapshot.film.n_iterations < 2 => as_picture(picture.rgb),
            View::Variance => scalar(snapshot.film.variance_of_mean(), true),
        }
    }

    fn hits(&mut self, snapshot: &Arc<Snapshot>) -> &FirstHits {
        let same = |of: &Snapshot| {
            Arc::ptr_eq(&of.scene, &snapshot.scene)
                && of.camera == snapshot.camera
                && (of.params.size, of.params.crop) == (snapshot.params.size, snapshot.params.crop)
        };
        let kept = self.hits.take().filter(|(of, _)| same(of));
        let (_, hits) = self.hits.insert(
            kept.unwrap_or_else(|| (Arc::clone(snapshot), FirstHits::trace(&snapshot.scene, &snapshot.view()))),
        );
        hits
    }
}

/// Nothing if no comparison is wanted that is painted here.
fn compared(
    picture: &Picture,
    reference: &Picture,
    painting: &Painting,
    exposure: f32,
) -> Result<Option<Colours>, String> {
    let mut rgba = vec![];
    let (values, legend, mean) = match painting.comparison {
        Comparison::Off | Comparison::Wipe => return Ok(None),
        Comparison::Difference(measure) => {
            let image = difference::image(picture, reference, measure)?;
            let end =
                painting.ends[measure as usize].unwrap_or_else(|| image.automatic_end(measure, (-exposure).exp2()));
            let legend = if measure == Measure::Signed {
                false_colour::signed(&image.values, end, &mut rgba);
                Legend { range: [-end, end], log: false, signed: true }
            } else {
                // Black is no difference.
                let scale = Scale { range: Some([0.0, end]), log: false };
                Legend { range: false_colour::scalar(&image.values, &scale, &mut rgba), log: false, signed: false }
            };
            (image.values, legend, image.mean)
        }
        Comparison::Flip => {
            let size = picture.crop_size();
            let [x, y] = [picture, reference].map(|p| {
                let mut shown = display::linear(&p.rgb, exposure, painting.look.tonemap);
                // A display shows a colour even there; a comparison leaves it out.
                for (shown, _) in shown.iter_mut().zip(&p.rgb).filter(|(_, rgb)| !rgb.iter().all(|c| c.is_finite())) {
                    *shown = [f32::NAN; 3];
                }
                shown
            });
            let flip = flip(&x, &y, size, flip::PIXELS_PER_DEGREE)?;
            let range = false_colour::scalar(&flip.error, &Scale { range: Some([0.0, 1.0]), log: false }, &mut rgba);
            (flip.error, Legend { range, log: false, signed: false }, flip.mean)
        }
    };
    Ok(Some(Colours { rgba, values: Values::Scalar(Arc::new(values)), legend: Some(legend), mean }))
}
