//! The time of cracks: play, stand still, go back, any moment.

use crate::{
    editor::subject::Subject,
    plugin::{CrackClock, CrackDrive},
};
use bevy_egui::egui::{self, Ui};

pub(super) fn show(ui: &mut Ui, subject: &mut Subject) {
    let (time, end) = (subject.state.time, subject.state.end);
    let mut clock = subject.clock.unwrap_or_default();
    let mut speed = match clock.drive {
        CrackDrive::Speed(speed) => speed,
        CrackDrive::Value(_) => 0.0,
    };
    let before = clock;
    ui.horizontal(|ui| {
        let pace = if speed == 0.0 { 1.0 } else { speed.abs() };
        if ui.button("⏮").on_hover_text("To the start").clicked() {
            clock = CrackClock { seek: Some(0.0), paused: true, drive: CrackDrive::Speed(pace) };
        }
        if ui.button("◀").on_hover_text("Backwards").clicked() {
            clock = CrackClock::speed(-pace);
        }
        let (label, hint) = if clock.paused { ("▶", "Play") } else { ("⏸", "Pause") };
        if ui.button(label).on_hover_text(hint).clicked() {
            clock.paused = !clock.paused;
            if speed < 0.0 || time >= end {
                clock.drive = CrackDrive::Speed(pace);
            }
        }
        if ui.button("⏭").on_hover_text("To the end").clicked() {
            clock = CrackClock { seek: Some(f32::INFINITY), paused: false, drive: CrackDrive::Speed(pace) };
        }
    });
    let mut shown = time;
    ui.spacing_mut().slider_width = (ui.available_width() - 110.0).max(80.0);
    let scrub = egui::Slider::new(&mut shown, 0.0..=end.max(1.0)).text("steps").max_decimals(1);
    if ui.add_enabled(end > 0.0, scrub).changed() {
        clock = CrackClock { seek: Some(shown), paused: true, drive: CrackDrive::Speed(1.0) };
    }
    if ui.add(egui::Slider::new(&mut speed, -4.0..=4.0).text("speed").max_decimals(2)).changed() {
        clock.drive = CrackDrive::Speed(speed);
        clock.paused = false;
    }
    if clock != before {
        subject.clock = Some(clock);
    }
}
