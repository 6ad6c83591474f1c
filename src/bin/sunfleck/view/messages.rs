//! What the window tells, in its corner: errors until they are dismissed or there are too many, the rest for a while.

use eframe::egui;

use super::engine::Message;

/// Messages that are no errors go away by themselves.
const SECONDS: f64 = 6.0;
/// At a time; the oldest give way, those that are no errors before those that are.
const MOST: usize = 6;

/// With the times they were said, the newest last.
#[derive(Default)]
pub struct Messages(Vec<(f64, Message)>);

impl Messages {
    /// Says something at `time`, seconds; what is said again moves to the end.
    pub fn say(&mut self, time: f64, message: Message) {
        self.0.retain(|(_, said)| *said != message);
        self.0.push((time, message));
        if self.0.len() > MOST {
            let first = self.0.iter().position(|(_, message)| !is_error(message)).unwrap_or(0);
            self.0.remove(first);
        }
    }

    /// Says everything again, to those whose clock begins anew.
    pub fn repeat(&mut self) {
        self.0.iter_mut().for_each(|(when, _)| *when = 0.0);
    }

    #[cfg(test)]
    pub fn texts(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(_, message)| match message {
            Message::Said(text) | Message::Warning(text) | Message::Error(text) => text.as_str(),
        })
    }

    pub fn show(&mut self, ui: &egui::Ui) {
        let now = ui.input(|i| i.time);
        self.0.retain(|(when, message)| is_error(message) || now - when < SECONDS);
        if self.0.is_empty() {
            return;
        }
        let mut dismissed = None;
        let corner = egui::Area::new(egui::Id::unique("messages")).anchor(egui::Align2::RIGHT_BOTTOM, [-12.0, -36.0]);
        corner.show(ui.ctx(), |ui| {
            for (i, (_, message)) in self.0.iter().enumerate() {
                let (text, color) = match message {
                    Message::Said(text) => (text, ui.visuals().text_color()),
                    Message::Warning(text) => (text, ui.visuals().warn_fg_color),
                    Message::Error(text) => (text, ui.visuals().error_fg_color),
                };
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.set_max_width(420.0);
                    ui.horizontal_wrapped(|ui| {
                        ui.colored_label(color, text);
                        if ui.small_button("Dismiss").clicked() {
                            dismissed = Some(i);
                        }
                    });
                });
            }
        });
        if let Some(i) = dismissed {
            self.0.remove(i);
        }
        // Errors stay; nobody need look after them.
        let passing = self.0.iter().filter(|(_, message)| !is_error(message));
        if let Some(end) = passing.map(|(when, _)| when + SECONDS).reduce(f64::min) {
            ui.ctx().request_repaint_after_secs((end - now).max(0.0) as f32);
        }
    }
}

fn is_error(message: &Message) -> bool {
    matches!(message, Message::Error(_))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_told_once_and_not_too_much_at_a_time() {
        let mut messages = Messages::default();
        for i in 0..20 {
            messages.say(f64::from(i), Message::Error(format!("{}", i % 8)));
        }
        assert_eq!(messages.texts().collect::<Vec<_>>(), ["6", "7", "0", "1", "2", "3"]);
        messages.say(20.0, Message::Error("7".to_owned()));
        assert_eq!(messages.texts().last(), Some("7"));
        assert_eq!(messages.texts().count(), MOST);
        messages.say(21.0, Message::Said("saved".to_owned()));
        assert_eq!(messages.texts().collect::<Vec<_>>(), ["6", "0", "1", "2", "3", "7"]);
    }
}
