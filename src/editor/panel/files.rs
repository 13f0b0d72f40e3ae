//! What can be written to files.

use super::settings::Panel;
use crate::editor::subject::{EditorCommand, Export};
use bevy_egui::egui::Ui;
use std::path::Path;

pub(super) fn show(ui: &mut Ui, panel: &mut Panel, asked: &mut Vec<EditorCommand>) {
    ui.horizontal(|ui| {
        ui.label("folder");
        ui.text_edit_singleline(&mut panel.folder);
    });
    ui.horizontal(|ui| {
        ui.label("preset");
        ui.text_edit_singleline(&mut panel.file).on_hover_text("CrackPreset::from_ron and the asset server read it.");
    });
    let folder = Path::new(&panel.folder);
    if ui.button("Save preset").clicked() {
        asked.push(EditorCommand::SavePreset(folder.join(&panel.file)));
    }
    ui.horizontal_wrapped(|ui| {
        for export in Export::ALL {
            if ui.button(export.label()).clicked() {
                asked.push(EditorCommand::Export(export, folder.to_owned()));
            }
        }
        let load = ui.button("Load cracks").on_hover_text("Those of “Save cracks”, in place of what is there.");
        if load.clicked() {
            asked.push(EditorCommand::LoadRecord(folder.join(Export::RECORD)));
        }
    });
}
