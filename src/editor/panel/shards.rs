//! Shattering.

use crate::{
    editor::{
        form,
        subject::{EditorCommand, Subject},
    },
    plugin::{CrackChips, ShatterCracks, ShatterRequest},
};
use bevy_egui::egui::Ui;

pub(super) fn show(ui: &mut Ui, subject: &mut Subject, energy: f32, asked: &mut Vec<EditorCommand>) {
    ui.horizontal(|ui| {
        if ui.button("Shatter").on_hover_text("Every piece that nothing holds falls.").clicked() {
            subject.shatter.get_or_insert_default().speed = 1.0;
            asked.push(EditorCommand::Shatter(ShatterRequest::ALL.with_energy(energy)));
        }
        if ui.button("Everything").on_hover_text("Also what is held, and what no crack has closed.").clicked() {
            subject.shatter.get_or_insert_default().speed = 1.0;
            asked.push(EditorCommand::Shatter(ShatterRequest::EVERYTHING.with_energy(energy)));
        }
        let shatter = subject.shatter.as_mut();
        if let Some(shatter) = shatter
            && subject.shards.is_some()
        {
            let (label, speed) = if shatter.speed < 0.0 { ("Forwards", 1.0) } else { ("Back", -1.0) };
            if ui.button(label).on_hover_text("Which way the time of the shards goes.").clicked() {
                shatter.speed = speed;
            }
        }
    });
    if let Some((shown, gone, all)) = subject.shards {
        ui.weak(format!("{all} shards: {gone} have left, {shown} are shown"));
    }
    match &mut subject.shatter {
        Some(shatter) => {
            form::show_fields(ui, shatter, &vec![&ShatterCracks::default()]);
        }
        None => {
            ui.weak("It shatters by default settings.");
            if ui.button("Settings of its own").clicked() {
                subject.shatter = Some(ShatterCracks::default());
            }
        }
    }
    let mut has_chips = subject.chips.is_some();
    let note = "What a hit knocks out of its crater flies off. The preset needs craters with terraces.";
    if ui.checkbox(&mut has_chips, "Chips fly out of craters").on_hover_text(note).changed() {
        subject.chips = has_chips.then(CrackChips::default);
    }
    if let Some(chips) = &mut subject.chips {
        form::show_fields(ui, chips, &vec![&CrackChips::default()]);
    }
}
