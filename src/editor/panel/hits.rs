//! Hits.

use super::settings::Panel;
use crate::editor::subject::EditorCommand;
use bevy::math::Vec2;
use bevy_egui::egui::{self, Ui};

pub(super) fn show(ui: &mut Ui, panel: &mut Panel, asked: &mut Vec<EditorCommand>) {
    ui.checkbox(&mut panel.hits_on_click, "A click hits the surface")
        .on_hover_text("Press on the surface to hit it there; drag before you let go to aim the blow.");
    ui.checkbox(&mut panel.hits_all, "and all others at the same place")
        .on_hover_text("To compare presets: give two surfaces the same seed.");
    ui.add(egui::Slider::new(&mut panel.energy, 0.05..=16.0).logarithmic(true).text("energy"))
        .on_hover_text("1 = as the preset says, 4 = twice as far.");
    ui.horizontal(|ui| {
        if ui.button("Hit the middle").clicked() {
            asked.push(EditorCommand::Hit(Vec2::splat(0.5)));
        }
        if ui.button("Heal").on_hover_text("The picture is as it was, at once.").clicked() {
            asked.push(EditorCommand::Heal);
        }
        if ui.button("Close").on_hover_text("All cracks run back the way they came.").clicked() {
            asked.push(EditorCommand::Close(1.5));
        }
    });
}
