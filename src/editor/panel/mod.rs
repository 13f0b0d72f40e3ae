//! The panel: functions from a [`Ui`] and settings to what a user asks for.

mod cost;
mod cracks;
mod files;
mod hits;
mod preset;
mod settings;
mod shards;
mod time;
mod views;

pub use settings::{Overlays, Panel};

use super::subject::{Costs, EditorCommand, Subject};
use bevy::prelude::Entity;
use bevy_egui::egui::{self, Ui};

impl Panel {
    /// Shows the panel for the chosen surface, one of `surfaces`. Changes of settings are made in `subject`; what is to be done besides is
    /// returned.
    ///
    /// ```
    /// use bevy_crack::editor::{AnalogyChoice, Costs, EditorCommand, Panel, Subject};
    /// use bevy_egui::egui;
    ///
    /// let like = AnalogyChoice { file: "clay.analogy.ron".into(), keeps_picture: true, seed: 0 };
    /// let (mut panel, mut subject) = (Panel::default(), Subject { analogy: Some(like), ..Subject::default() });
    /// let ctx = egui::Context::default();
    /// let mut output = ctx.run_ui(egui::RawInput::default(), |ui| {
    ///     let asked: Vec<EditorCommand> = panel.show(ui, &[], Some(&mut subject), &Costs::default());
    ///     assert!(asked.is_empty());
    /// });
    /// assert!(!output.shapes.is_empty());
    /// // With no window there is no painter to take egui's font texture.
    /// output.textures_delta.clear();
    /// # let _ = subject;
    /// ```
    pub fn show(
        &mut self,
        ui: &mut Ui,
        surfaces: &[(Entity, String)],
        subject: Option<&mut Subject>,
        costs: &Costs,
    ) -> Vec<EditorCommand> {
        let mut asked = Vec::new();
        ui.spacing_mut().item_spacing.y = 4.0;
        self.bar(ui, surfaces, subject.as_deref(), &mut asked);
        ui.separator();
        match subject {
            Some(subject) => self.sections(ui, subject, &mut asked),
            None => {
                ui.label("Click a surface, or choose one above.");
                ui.weak("A surface is an entity with a CrackSurface.");
            }
        }
        section(ui, "Cost", false, |ui| cost::show(ui, costs));
        if !self.message.is_empty() {
            ui.separator();
            ui.label(&self.message);
        }
        asked
    }

    fn bar(
        &mut self,
        ui: &mut Ui,
        surfaces: &[(Entity, String)],
        subject: Option<&Subject>,
        asked: &mut Vec<EditorCommand>,
    ) {
        ui.horizontal(|ui| {
            let name = subject.map_or("no surface", |subject| &subject.name);
            egui::ComboBox::from_id_salt("surface").selected_text(name).width(150.0).show_ui(ui, |ui| {
                for (entity, other) in surfaces {
                    if ui.selectable_label(subject.is_some_and(|subject| subject.name == *other), other).clicked() {
                        asked.push(EditorCommand::Choose(*entity));
                    }
                }
            });
            let (undo, redo) = self.can_undo;
            if ui.add_enabled(undo, egui::Button::new("Undo")).clicked() {
                asked.push(EditorCommand::Undo);
            }
            if ui.add_enabled(redo, egui::Button::new("Redo")).clicked() {
                asked.push(EditorCommand::Redo);
            }
        });
    }

    fn sections(&mut self, ui: &mut Ui, subject: &mut Subject, asked: &mut Vec<EditorCommand>) {
        cracks::show_state(ui, &subject.state);
        section(ui, "Hit", true, |ui| hits::show(ui, self, asked));
        section(ui, "Time", true, |ui| time::show(ui, subject));
        section(ui, "Preset", true, |ui| preset::show(ui, subject));
        section(ui, "Shatter", false, |ui| shards::show(ui, subject, self.energy, asked));
        section(ui, "Guided cracks", false, |ui| cracks::show_guided(ui, self, subject));
        section(ui, "Strands", false, |ui| cracks::show_strands(ui, self, subject));
        section(ui, "Relief", false, |ui| cracks::show_relief(ui, self, subject));
        section(ui, "Photographs", false, |ui| cracks::show_analogy(ui, self, subject));
        section(ui, "Overlays", false, |ui| views::show_overlays(ui, &mut self.overlays));
        section(ui, "Textures", false, |ui| views::show_textures(ui, &subject.textures));
        section(ui, "Save and export", false, |ui| files::show(ui, self, asked));
    }
}

/// A part of the panel that can be closed.
fn section(ui: &mut Ui, title: &str, is_open: bool, content: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(egui::RichText::new(title).strong()).default_open(is_open).show(ui, content);
}
