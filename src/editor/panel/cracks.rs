//! The state of cracks, and what is baked: guided cracks, strands, reliefs.

use super::settings::Panel;
use crate::{
    editor::{form, subject::Subject},
    plugin::{CrackGuide, CrackRelief, CrackState, CrackStatus, CrackStrands, GuideSource, GuidedCracks, HitPoint},
};
use bevy::math::Vec2;
use bevy_egui::egui::{self, Ui};

pub(super) fn show_state(ui: &mut Ui, state: &CrackState) {
    let text = match &state.status {
        CrackStatus::Untouched => "untouched".to_owned(),
        CrackStatus::Waiting => "waiting for its picture".to_owned(),
        CrackStatus::Growing => "growing".to_owned(),
        CrackStatus::Done => "at rest".to_owned(),
        CrackStatus::Failed(error) => {
            ui.colored_label(ui.visuals().error_fg_color, error.to_string());
            return;
        }
    };
    ui.horizontal_wrapped(|ui| {
        ui.strong(text);
        ui.weak(format!(
            "damage {:.0} %, hits {}, nodes {}, cells {}",
            state.damage * 100.0,
            state.hits,
            state.nodes,
            state.cells
        ));
    });
}

pub(super) fn show_guided(ui: &mut Ui, panel: &mut Panel, subject: &mut Subject) {
    ui.horizontal(|ui| {
        ui.label("text");
        if ui.text_edit_singleline(&mut panel.text).changed() {
            panel.guided.guides = guides(&panel.text);
        }
    });
    ui.weak("No text: cracks of plain mud.");
    form::show_fields(ui, &mut panel.guided, &vec![&GuidedCracks::new(CrackGuide::text("CRACK"))]);
    bake_buttons(
        ui,
        &panel.guided.validate().map_err(|error| error.to_string()),
        subject,
        |subject| {
            if subject.guided.as_ref() == Some(&panel.guided) {
                // The same once more: what was healed comes again.
                panel.guided.seed = panel.guided.seed.wrapping_add(1);
            }
            subject.guided = Some(panel.guided.clone());
        },
        |subject| subject.guided = None,
        (subject.guided.is_some(), baked(subject)),
    );
}

fn guides(text: &str) -> Vec<CrackGuide> {
    if text.trim().is_empty() {
        Vec::new()
    } else {
        vec![CrackGuide::new(GuideSource::Text { text: text.into(), font: None })]
    }
}

pub(super) fn show_strands(ui: &mut Ui, panel: &mut Panel, subject: &mut Subject) {
    form::show_fields(ui, &mut panel.strands, &vec![&CrackStrands::default()]);
    if panel.strands.starts.is_empty() && ui.button("Start at the left").clicked() {
        panel.strands.starts = [0.25, 0.5, 0.75].map(|v| HitPoint::Uv(Vec2::new(0.0, v))).into();
    }
    bake_buttons(
        ui,
        &panel.strands.validate().map_err(|error| error.to_string()),
        subject,
        |subject| {
            if subject.strands.as_ref() == Some(&panel.strands) {
                panel.strands.seed = panel.strands.seed.wrapping_add(1);
            }
            subject.strands = Some(panel.strands.clone());
        },
        |subject| subject.strands = None,
        (subject.strands.is_some(), baked(subject)),
    );
}

pub(super) fn show_relief(ui: &mut Ui, panel: &mut Panel, subject: &mut Subject) {
    ui.horizontal(|ui| {
        let kinds: [(&str, fn() -> CrackRelief); 3] =
            [("Rock", CrackRelief::rock_wall), ("Island", CrackRelief::island), ("Mountain", CrackRelief::mountain)];
        for (name, kind) in kinds {
            if ui.button(name).clicked() {
                panel.relief = CrackRelief { settings: kind().settings, ..panel.relief.clone() };
            }
        }
    });
    form::show_fields(ui, &mut panel.relief, &vec![&CrackRelief::default()]);
    bake_buttons(
        ui,
        &panel.relief.validate().map_err(|error| error.to_string()),
        subject,
        |subject| {
            if subject.relief.as_ref() == Some(&panel.relief) {
                panel.relief.seed = panel.relief.seed.wrapping_add(1);
            }
            subject.relief = Some(panel.relief.clone());
        },
        |subject| subject.relief = None,
        (subject.relief.is_some(), subject.relief_progress),
    );
}

pub(super) fn show_analogy(ui: &mut Ui, panel: &mut Panel, subject: &mut Subject) {
    let choice = &mut panel.analogy;
    ui.horizontal(|ui| {
        ui.label("File").on_hover_text("A file `*.analogy.ron` in the assets, beside its photographs");
        ui.add(egui::TextEdit::singleline(&mut choice.file).desired_width(220.0));
    });
    ui.checkbox(&mut choice.keeps_picture, "Keep the picture").on_hover_text(
        "Away from its cracks the surface keeps its own picture; else it takes the material of the photographs",
    );
    ui.horizontal(|ui| {
        ui.label("Seed");
        ui.add(egui::DragValue::new(&mut choice.seed));
    });
    bake_buttons(
        ui,
        &if choice.file.trim().is_empty() { Err("A file is missing".to_owned()) } else { Ok(()) },
        subject,
        |subject| {
            if subject.analogy.as_ref() == Some(choice) {
                choice.seed = choice.seed.wrapping_add(1);
            }
            subject.analogy = Some(choice.clone());
        },
        |subject| subject.analogy = None,
        (subject.analogy.is_some(), subject.analogy_progress),
    );
    if subject.analogy.is_some() && ui.button("Remove").clicked() {
        subject.analogy = None;
    }
}

/// How far the baked cracks of a surface are.
fn baked(subject: &Subject) -> f32 {
    subject.progress.as_ref().map_or(0.0, |progress| progress.0)
}

/// Starts a bake, shows how far it is, and cancels it.
fn bake_buttons(
    ui: &mut Ui,
    check: &Result<(), String>,
    subject: &mut Subject,
    bake: impl FnOnce(&mut Subject),
    cancel: impl FnOnce(&mut Subject),
    (is_there, progress): (bool, f32),
) {
    if let Err(error) = check {
        ui.colored_label(ui.visuals().warn_fg_color, error);
    }
    ui.horizontal(|ui| {
        if ui.add_enabled(check.is_ok(), egui::Button::new("Bake")).clicked() {
            bake(subject);
        } else if is_there && progress < 1.0 && ui.button("Cancel").clicked() {
            cancel(subject);
        }
        if is_there {
            ui.add(egui::ProgressBar::new(progress).desired_width(140.0).show_percentage());
        }
    });
}
