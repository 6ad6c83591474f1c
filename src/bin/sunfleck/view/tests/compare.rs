//! The picture beside a reference.

use std::sync::Arc;

use sunfleck::output::Picture;
use sunfleck::output::false_colour::NOT_FINITE;

use super::Window;
use crate::view::engine::{Comparison, Painted, Reference};

/// Compares the picture by FLIP with itself after `change`.
fn compared(window: &mut Window, change: impl FnOnce(&mut Picture)) -> Arc<Painted> {
    let mut picture = window.viewer().now.frame.as_ref().unwrap().picture();
    change(&mut picture);
    let reference = Arc::new(Reference { name: "changed.exr".into(), picture });
    window.viewer().engine().set_reference(Some(Arc::clone(&reference)));
    window.viewer().wanted.painting.comparison = Comparison::Flip;
    window.wait("comparison", |viewer| {
        viewer.picture.painted().is_some_and(|painted| {
            painted.painting == viewer.wanted.painting
                && painted.reference.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, &reference))
        })
    });
    window.steps(2);
    window.viewer().picture.painted().unwrap().clone()
}

#[test]
fn what_is_not_finite_is_left_out_and_told() {
    let mut window = Window::with_picture();
    let painted = compared(&mut window, |_| {});
    assert_eq!(painted.mean, Some(0.0));
    assert!(window.shows("relMSE, trimmed") && window.shows("Largest difference") && !window.shows("Not finite"));

    let painted = compared(&mut window, |picture| picture.rgb[5] = [1.0, f32::NAN, 1.0]);
    assert_eq!(painted.mean, Some(0.0));
    assert!(painted.rgba[20..24] == NOT_FINITE && painted.value(5, 0)[0].is_nan() && painted.value(6, 0) == [0.0]);
    assert!(window.shows("Not finite") && window.shows("1 of 768"));

    let painted = compared(&mut window, |picture| picture.rgb.fill([f32::NAN; 3]));
    assert!(painted.mean.is_none() && painted.figures.is_none());
    assert!(window.viewer().engine().history(|history| history.against_reference.last().is_none()));

    let painted = compared(&mut window, |picture| picture.rgb.fill([0.0; 3]));
    assert!(painted.figures.is_some_and(|figures| figures.relative_mean_difference.is_none()));
    assert!(!window.shows(" %"));
}
