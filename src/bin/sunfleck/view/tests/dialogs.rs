//! The system's dialogs: what they begin with, and what is done with their answers.

use std::sync::{Arc, Mutex};

use eframe::egui::{Key, Modifiers};

use super::Window;
use super::habits::{OWN, with_file};
use crate::view::dialog::{Answer, Purpose, Request, ask};

#[test]
fn without_dialogs_it_is_said_what_else_there_is() {
    let mut window = Window::new(None);
    window.viewer().pick = Arc::new(|_| Answer::NoDialog);
    window.press(Modifiers::COMMAND, Key::O);
    window.wait_for_message("no file dialog");
    assert!(window.viewer().dialog.is_none());
}

#[test]
fn a_picture_or_settings_are_saved_under_no_other_name() {
    let mut window = Window::with_picture();
    let wrong = window.path("picture.jpg");
    let asked = wrong.clone();
    window.viewer().pick = Arc::new(move |_| Answer::File(asked.clone()));
    window.press(Modifiers::COMMAND, Key::S);
    window.wait_for_message("picture.jpg: a picture ends in .exr or .png");
    ask(window.viewer(), Purpose::SaveSettings);
    window.wait_for_message("picture.jpg: settings end in .toml");
    assert!(window.viewer().saved_as.is_empty() && !wrong.exists());
}

#[test]
fn a_dialog_begins_where_the_last_one_ended() {
    let (mut window, file) = with_file(OWN);
    let (chosen, requests) = (Arc::new(Mutex::new(window.path("a/first.exr"))), Arc::new(Mutex::new(vec![])));
    let (answer, noted) = (Arc::clone(&chosen), Arc::clone(&requests));
    window.viewer().pick = Arc::new(move |request| {
        noted.lock().unwrap().push(request.clone());
        Answer::File(answer.lock().unwrap().clone())
    });
    std::fs::create_dir(window.path("a")).unwrap();
    let ask = |window: &mut Window, purpose| {
        ask(window.viewer(), purpose);
        window.wait("dialog's answer", |viewer| viewer.dialog.is_none());
        let Request { folder, name, .. } = requests.lock().unwrap().pop().unwrap();
        (folder, name)
    };
    let (beside, here) = (file.parent().unwrap().to_owned(), std::env::current_dir().unwrap());
    let stem = file.file_stem().unwrap().to_string_lossy();
    // The first beside the scene, pictures where the program was started.
    assert_eq!(ask(&mut window, Purpose::Reference).0, beside);
    assert_eq!(ask(&mut window, Purpose::SavePicture), (here.clone(), format!("{stem}.exr")));
    assert_eq!(ask(&mut window, Purpose::SavePicture), (beside.join("a"), "first.exr".to_owned()));
    assert_eq!(ask(&mut window, Purpose::Reference).0, beside.join("a"));
    assert_eq!(ask(&mut window, Purpose::SaveSettings), (beside.clone(), format!("{stem}.toml")));
    *chosen.lock().unwrap() = window.path("a/other scene.toml");
    assert_eq!(ask(&mut window, Purpose::Open).0, beside);
    // A shipped scene lies nowhere.
    window.viewer().open("cornell");
    assert_eq!(ask(&mut window, Purpose::Environment), (here, String::new()));
    assert_eq!(ask(&mut window, Purpose::Open).0, beside.join("a"));
}

#[test]
fn a_name_without_an_extension_gets_one_and_replaces_no_file() {
    let mut window = Window::with_picture();
    let typed = window.path("typed");
    window.viewer().pick = Arc::new(move |_| Answer::File(typed.clone()));
    std::fs::write(window.path("typed-1.toml"), "kept").unwrap();
    for name in ["typed.toml", "typed-2.toml"] {
        ask(window.viewer(), Purpose::SaveSettings);
        window.wait_for_message(name);
        assert!(window.path(name).exists());
    }
    ask(window.viewer(), Purpose::SavePicture);
    window.wait_for_message("typed.exr");
    let saved = window.path("typed.exr");
    assert_eq!(window.viewer().place(), Some(&saved));
    assert_eq!(std::fs::read_to_string(window.path("typed-1.toml")).unwrap(), "kept");
    // What is opened is called what it is called.
    ask(window.viewer(), Purpose::Open);
    window.wait_for_message("typed: ");
}
