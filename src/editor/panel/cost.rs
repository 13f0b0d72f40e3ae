//! What cracks cost.

use crate::editor::subject::Costs;
use bevy_egui::egui::{self, Ui};

pub(super) fn show(ui: &mut Ui, costs: &Costs) {
    let share = if costs.budget > 0.0 { costs.milliseconds / costs.budget } else { 0.0 };
    let text = format!("{:.2} of {:.1} ms a frame", costs.milliseconds, costs.budget);
    ui.add(egui::ProgressBar::new(share.clamp(0.0, 1.0)).text(text))
        .on_hover_text("Time of the crate's systems in the last frame. CrackBudget::milliseconds is the limit.");
    egui::Grid::new("cost").num_columns(2).show(ui, |ui| {
        for (name, value) in [
            ("uploaded", format!("{} in {} rectangles", bytes(costs.bytes), costs.rects)),
            ("textures", bytes(costs.texture_bytes)),
            ("cracked surfaces", costs.cracked.to_string()),
            ("nodes", costs.nodes.to_string()),
        ] {
            ui.weak(name);
            ui.label(value);
            ui.end_row();
        }
    });
}

fn bytes(bytes: u64) -> String {
    match bytes {
        0..1024 => format!("{bytes} B"),
        1024..1_048_576 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        _ => format!("{:.1} MiB", bytes as f64 / 1_048_576.0),
    }
}
