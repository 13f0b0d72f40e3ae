//! The preset of a surface, and what else its component says.

use crate::{
    CrackPreset,
    editor::{form, subject::Subject},
    plugin::PresetSource,
};
use bevy::reflect::PartialReflect;
use bevy_egui::egui::{self, Ui};
use std::sync::LazyLock;

/// All presets that ship with the crate, by name.
static PRESETS: LazyLock<Vec<(&str, CrackPreset)>> = LazyLock::new(|| {
    let named = CrackPreset::NAMES.iter().map(|name| (*name, CrackPreset::named(name)));
    named.filter_map(|(name, preset)| preset.map(|preset| (name, preset))).collect()
});

pub(super) fn show(ui: &mut Ui, subject: &mut Subject) {
    let mut preset = match &subject.surface.preset {
        PresetSource::Inline(preset) => preset.clone(),
        PresetSource::Asset(handle) => {
            let file = handle.path().map_or_else(|| "an asset".to_owned(), ToString::to_string);
            ui.weak(format!("from {file}; a change makes it the surface's own"));
            subject.preset.clone().unwrap_or_default()
        }
    };
    let (number, base) = closest(&preset);
    let mut changed = false;
    ui.horizontal(|ui| {
        let label = format!("{}{}", words(base.0), if base.1 == preset { "" } else { " (changed)" });
        egui::ComboBox::from_id_salt("preset").selected_text(label).width(150.0).show_ui(ui, |ui| {
            for (i, (name, other)) in PRESETS.iter().enumerate() {
                if ui.selectable_label(i == number, words(name)).clicked() {
                    preset = other.clone();
                    changed = true;
                }
            }
        });
        if ui.add_enabled(base.1 != preset && !changed, egui::Button::new("Reset")).clicked() {
            preset = base.1.clone();
            changed = true;
        }
    });
    ui.horizontal(|ui| {
        ui.label("seed");
        ui.add(egui::DragValue::new(&mut subject.surface.seed));
        let dice = ui.button("🎲").on_hover_text("Another seed. It takes effect after healing.");
        if dice.clicked() {
            subject.surface.seed = subject.surface.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1) >> 33;
        }
    });
    let examples: Vec<&dyn PartialReflect> = core::iter::once(&base.1)
        .chain(PRESETS.iter().map(|(_, preset)| preset))
        .map(|preset| preset as &dyn PartialReflect)
        .collect();
    changed |= form::show_fields(ui, &mut preset, &examples);
    if let Err(error) = preset.validate() {
        ui.colored_label(ui.visuals().warn_fg_color, error.to_string());
    } else if changed {
        subject.surface.preset = PresetSource::Inline(preset);
    }
    let default = crate::plugin::CrackSurface::default();
    ui.collapsing("surface", |ui| {
        form::show_some(ui, &mut subject.surface, &default, &["resolution", "write", "alpha_mask", "mask"]);
    });
}

fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// The preset that this one was made from: the one with the same look if there is one, else with the most fields in common.
fn closest(preset: &CrackPreset) -> (usize, &'static (&'static str, CrackPreset)) {
    let score = |other: &CrackPreset| {
        let parts = [
            other.growth.markers == preset.growth.markers,
            other.growth.starts == preset.growth.starts,
            other.growth.venation == preset.growth.venation,
            other.growth.kill_distance == preset.growth.kill_distance,
            other.growth.reach == preset.growth.reach,
            other.growth.line_width == preset.growth.line_width,
            other.look.ramp == preset.look.ramp,
            other.look.relief == preset.look.relief,
            other.profile == preset.profile,
            other.steps_per_second == preset.steps_per_second,
        ];
        parts.into_iter().filter(|is_same| *is_same).count() + 10 * usize::from(other == preset)
    };
    let best = PRESETS.iter().enumerate().rev().max_by_key(|(_, (_, other))| score(other));
    // There are presets.
    best.unwrap_or_else(|| (0, &PRESETS[0]))
}
