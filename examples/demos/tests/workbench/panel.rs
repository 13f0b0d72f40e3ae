//! The panel: every control does what it says.

use crate::{app, state, wait_for};
use bevy::{camera::Viewport, ecs::name::NameOrEntity, prelude::*};
use bevy_crack::{
    editor::{
        AnalogyChoice, Costs, CrackEditor, CrackEditorPlugin, EditorCommand, Export, Panel, PrimaryEguiContext, Subject,
    },
    growth::MarkerLayout,
    plugin::{CrackDrive, PresetSource},
    prelude::*,
};
use bevy_egui::{EguiSchedule, egui};
use egui_kittest::{Harness, kittest::Queryable};
use std::path::Path;

/// A panel and what it was asked for.
struct Shown {
    panel: Panel,
    subject: Subject,
    asked: Vec<EditorCommand>,
}

fn subject() -> Subject {
    let state = CrackState { end: 40.0, time: 12.0, nodes: 17, hits: 1, ..default() };
    Subject { name: "wall".into(), state, surface: CrackSurface::new(CrackPreset::GLASS), ..default() }
}

fn harness<'a>() -> Harness<'a, Shown> {
    let shown = Shown { panel: Panel::default(), subject: subject(), asked: Vec::new() };
    Harness::builder().with_size([360.0, 2400.0]).build_ui_state(
        |ui, shown: &mut Shown| {
            let asked = shown.panel.show(ui, &[], Some(&mut shown.subject), &Costs::default());
            shown.asked.extend(asked);
        },
        shown,
    )
}

impl Shown {
    fn preset(&self) -> &CrackPreset {
        match &self.subject.surface.preset {
            PresetSource::Inline(preset) => preset,
            PresetSource::Asset(_) => panic!("the preset is the surface's own"),
        }
    }
}

/// Presses what has this label, and lets egui come to rest.
fn press(harness: &mut Harness<Shown>, label: &str) {
    harness.get_by_label(label).click();
    harness.run();
}

#[test]
fn buttons_ask_for_what_they_say() {
    let mut harness = harness();
    for (label, wanted) in [
        ("Hit the middle", EditorCommand::Hit(Vec2::splat(0.5))),
        ("Heal", EditorCommand::Heal),
        ("Close", EditorCommand::Close(1.5)),
    ] {
        press(&mut harness, label);
        assert_eq!(harness.state_mut().asked.split_off(0), [wanted], "{label}");
    }
    press(&mut harness, "Save and export");
    press(&mut harness, "Save preset");
    let asked = harness.state_mut().asked.split_off(0);
    assert!(
        matches!(&asked[..], [EditorCommand::SavePreset(path)] if path.ends_with("cracks/mine.crack.ron")),
        "{asked:?}"
    );
    for export in Export::ALL {
        press(&mut harness, export.label());
        assert_eq!(harness.state_mut().asked.split_off(0), [EditorCommand::Export(export, "cracks".into())]);
    }
    press(&mut harness, "Load cracks");
    let asked = harness.state_mut().asked.split_off(0);
    assert_eq!(asked, [EditorCommand::LoadRecord(Path::new("cracks").join(Export::RECORD))]);
    press(&mut harness, "Shatter");
    // The first is the header.
    harness.get_all_by_label("Shatter").last().expect("a button").click();
    harness.run();
    let asked = harness.state_mut().asked.split_off(0);
    assert_eq!(asked, [EditorCommand::Shatter(ShatterRequest::ALL.with_energy(1.0))]);
    assert!(harness.state().subject.shatter.is_some());
    press(&mut harness, "Chips fly out of craters");
    assert_eq!(harness.state().subject.chips, Some(CrackChips::default()));
    press(&mut harness, "Chips fly out of craters");
    assert_eq!(harness.state().subject.chips, None);
}

#[test]
fn a_preset_is_chosen_changed_and_reset() {
    let mut harness = harness();
    assert_eq!(harness.state().preset(), &CrackPreset::GLASS);
    press(&mut harness, "growth");
    // A slider's number is typed over.
    let before = harness.state().preset().growth.inertia;
    let field = harness.get_all_by_label("inertia").last().expect("a slider");
    field.focus();
    harness.run();
    harness.key_press(egui::Key::ArrowRight);
    harness.run();
    let after = harness.state().preset().growth.inertia;
    assert!(after > before, "{before} {after}");
    assert_eq!(harness.state().preset().validate(), Ok(()));
    press(&mut harness, "Reset");
    assert_eq!(harness.state().preset(), &CrackPreset::GLASS);
}

#[test]
fn invalid_settings_are_said_and_stay_out() {
    let mut harness = harness();
    let mut broken = CrackPreset::GLASS;
    broken.growth.kill_distance = 3.0;
    broken.growth.crack_radius = 0.01;
    assert!(broken.validate().is_err());
    harness.state_mut().subject.surface.preset = PresetSource::Inline(broken);
    harness.run();
    let complaint = harness.get_all_by(|node| node.value().or(node.label()).is_some_and(|text| text.contains("must")));
    assert!(complaint.count() >= 1, "it says what is wrong");
}

#[test]
fn time_is_played_stopped_and_turned_back() {
    let mut harness = harness();
    press(&mut harness, "◀");
    let clock = harness.state().subject.clock.expect("a clock");
    assert_eq!((clock.drive, clock.paused), (CrackDrive::Speed(-1.0), false));
    press(&mut harness, "⏸");
    assert!(harness.state().subject.clock.expect("a clock").paused);
    press(&mut harness, "⏭");
    assert_eq!(harness.state().subject.clock.expect("a clock").seek, Some(f32::INFINITY));
    press(&mut harness, "⏮");
    let clock = harness.state().subject.clock.expect("a clock");
    assert_eq!((clock.seek, clock.paused), (Some(0.0), true));
}

#[test]
fn guided_cracks_are_baked_and_cancelled() {
    let mut harness = harness();
    press(&mut harness, "Guided cracks");
    press(&mut harness, "Bake");
    let guided = harness.state().subject.guided.clone().expect("guided cracks");
    assert_eq!(guided.validate(), Ok(()));
    // Once more: another seed, so that it is baked again.
    press(&mut harness, "Bake");
    assert_ne!(harness.state().subject.guided.as_ref(), Some(&guided));
    press(&mut harness, "Cancel");
    assert_eq!(harness.state().subject.guided, None);
}

#[test]
fn photographs_are_chosen_and_removed() {
    let mut harness = harness();
    press(&mut harness, "Photographs");
    press(&mut harness, "Keep the picture");
    press(&mut harness, "Bake");
    let choice = harness.state().subject.analogy.clone().expect("a choice");
    let file = format!("analogies/clay.{}", AnalogyExamples::EXTENSION);
    assert_eq!(choice, AnalogyChoice { file, keeps_picture: false, seed: 0 });
    // Once more: another seed, so that it is made again.
    press(&mut harness, "Bake");
    assert_eq!(harness.state().subject.analogy, Some(AnalogyChoice { seed: 1, ..choice }));
    press(&mut harness, "Remove");
    assert_eq!(harness.state().subject.analogy, None);
}

#[test]
fn overlays_and_tools_are_switched() {
    let mut harness = harness();
    press(&mut harness, "Overlays");
    for label in ["network", "tips", "markers", "reach and kill distance", "cells", "dirty rectangles"] {
        press(&mut harness, label);
    }
    let overlays = harness.state().panel.overlays;
    assert!(
        overlays.network && overlays.tips && overlays.markers && overlays.radii && overlays.cells && overlays.dirty
    );
    press(&mut harness, "A click hits the surface");
    assert!(!harness.state().panel.hits_on_click);
}

#[test]
fn every_section_can_be_opened_on_every_preset() {
    for name in CrackPreset::NAMES {
        let mut harness = harness();
        let preset = CrackPreset::named(name).expect("a preset");
        harness.state_mut().subject.surface = CrackSurface::new(preset.clone());
        for section in ["growth", "profile", "look", "Guided cracks", "Strands", "Textures", "Cost"] {
            press(&mut harness, section);
        }
        assert_eq!(harness.state().preset(), &preset, "looking changes nothing");
        assert!(harness.state().asked.is_empty());
    }
}

/// Of cameras that are spawned in one frame, in any order, the panel is drawn by the last one that has the whole window; one that the
/// game has chosen is left alone.
#[test]
fn the_panel_is_in_the_whole_window() {
    let part =
        || Camera { order: 2, viewport: Some(Viewport { physical_size: UVec2::splat(64), ..default() }), ..default() };
    let over = || Camera { order: 1, ..default() };
    let chosen = |app: &mut App| {
        let mut chosen = app.world_mut().query_filtered::<NameOrEntity, With<PrimaryEguiContext>>();
        let chosen = chosen.single(app.world()).expect("one camera draws the panel");
        chosen.name.expect("a name").to_string()
    };
    for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2]] {
        let mut app = app(|app| {
            app.add_plugins(CrackEditorPlugin::default());
        });
        for i in order {
            let name = Name::new(["part", "over", "under"][i]);
            match i {
                0 => app.world_mut().spawn((Camera3d::default(), part(), name)),
                1 => app.world_mut().spawn((Camera2d, over(), name)),
                _ => app.world_mut().spawn((Camera3d::default(), name)),
            };
        }
        for _ in 0..3 {
            app.update();
            assert_eq!(chosen(&mut app), "over", "spawned as {order:?}");
        }
        app.world_mut().spawn((Camera2d, Camera { order: 3, ..default() }, Name::new("of the next level")));
        app.update();
        assert_eq!(chosen(&mut app), "over", "the panel does not jump");
        // As if that camera had gone: without a renderer the engine cannot despawn one.
        let mut chosen_one = app.world_mut().query_filtered::<Entity, With<PrimaryEguiContext>>();
        let camera = chosen_one.single(app.world()).expect("one");
        app.world_mut().entity_mut(camera).remove::<(PrimaryEguiContext, EguiSchedule)>();
        app.update();
        assert_eq!(chosen(&mut app), "of the next level");
    }
    let mut app = app(|app| {
        app.add_plugins(CrackEditorPlugin::default());
    });
    app.world_mut().spawn((Camera2d, over()));
    app.world_mut().spawn((Camera2d, Name::new("the game's choice"), PrimaryEguiContext));
    for _ in 0..3 {
        app.update();
        assert_eq!(chosen(&mut app), "the game's choice");
    }
}

/// In an app without a renderer: what the panel changes reaches the surface, and can be taken back.
#[test]
fn the_editor_works_in_an_app() {
    let mut app = app(|app| {
        app.add_plugins(CrackEditorPlugin::default());
    });
    app.world_mut().spawn(Camera2d);
    let picture = app.world().resource::<AssetServer>().load("textures/plaster.png");
    let wall = app
        .world_mut()
        .spawn((Sprite::from_image(picture), CrackSurface::new(CrackPreset::PLASTER), Name::new("wall")))
        .id();
    app.update();
    app.world_mut().trigger(CrackHit::uv(wall, Vec2::splat(0.5)));
    wait_for(&mut app, "cracks", |app| state(app, wall).status == CrackStatus::Done);
    assert!(state(&app, wall).nodes > 0);
    assert!(app.world().contains_resource::<CrackEditor>());
    // Hidden and shown.
    for is_open in [false, true] {
        app.world_mut().resource_mut::<CrackEditor>().is_open = is_open;
        app.update();
    }
    // Any marker layout that a list can show is one that works.
    let layout = MarkerLayout::PseudoGrid { occupancy: 1.0, jitter: 0.5 };
    let mut surface = app.world_mut().get_mut::<CrackSurface>(wall).expect("the surface");
    surface.preset.as_mut().expect("its own").growth.markers = layout;
    app.update();
    assert_ne!(state(&app, wall).status, CrackStatus::Untouched);
}
