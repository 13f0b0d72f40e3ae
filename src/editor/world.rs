//! The panel and the world: what it shows comes from components, what it changes goes to them.

use super::{
    export,
    history::Settings,
    overlay,
    state::CrackEditor,
    subject::{AnalogyChoice, Costs, EditorCommand, Subject},
};
use crate::{
    CrackPreset,
    plugin::{
        AnalogyProgress, BakeProgress, CrackAnalogy, CrackChips, CrackClock, CrackCommandsExt, CrackHit, CrackRelief,
        CrackShards, CrackState, CrackStrands, CrackSurface, CrackTextures, CrackUploadStats, GuidedCracks,
        PresetSource, ReliefProgress, Shard, ShatterCracks, inspect,
    },
};
use bevy::{
    ecs::component::Mutable,
    prelude::*,
    tasks::{block_on, futures_lite::future},
};
use bevy_egui::{EguiContext, EguiTextureHandle, EguiUserTextures, PrimaryEguiContext, egui};

/// The most surfaces in the list.
const MOST: usize = 100;

/// Shows the panel, and does what it is asked for.
pub(super) fn show_panel(world: &mut World) {
    let Ok(mut context) = world.query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>().single_mut(world) else {
        return;
    };
    let ctx = context.get_mut().clone();
    let Some(mut editor) = world.remove_resource::<CrackEditor>() else { return };
    collect_exports(&mut editor);
    let surfaces = surfaces(world);
    if editor.chosen.is_none_or(|chosen| world.get::<CrackSurface>(chosen).is_none()) {
        editor.chosen = surfaces.first().map(|(entity, _)| *entity);
    }
    let mut subject = editor.chosen.and_then(|chosen| gather(world, chosen));
    overlay::draw(world, &ctx, &mut editor);
    let costs = costs(world);
    editor.panel.can_undo = editor.history.can_step();
    let before = subject.as_ref().map(settings);
    let mut asked = Vec::new();
    let screen = ctx.content_rect();
    egui::Window::new("Cracks")
        .default_pos(screen.right_top() + egui::vec2(-364.0, 12.0))
        .default_width(340.0)
        .default_height(screen.height() - 60.0)
        .max_height(screen.height() - 40.0)
        .vscroll(true)
        .show(&ctx, |ui| asked = editor.panel.show(ui, &surfaces, subject.as_mut(), &costs));
    if !ctx.input(|input| input.pointer.any_down()) {
        editor.history.release();
    }
    if let (Some(entity), Some(subject), Some(before)) = (editor.chosen, &subject, before) {
        let after = settings(subject);
        if before != after {
            put(world, entity, &before, after.clone());
            editor.history.note(entity, before, &after, ctx.input(|input| input.pointer.any_down()));
        }
    }
    for command in asked {
        obey(world, &mut editor, command);
    }
    world.insert_resource(editor);
}

/// All surfaces with their names, shards aside.
fn surfaces(world: &mut World) -> Vec<(Entity, String)> {
    let mut all = world.query_filtered::<(Entity, Option<&Name>), (With<CrackSurface>, Without<Shard>)>();
    let mut all: Vec<_> = all.iter(world).map(|(entity, name)| (entity, label(entity, name))).collect();
    all.sort_unstable();
    all.truncate(MOST);
    all
}

fn label(entity: Entity, name: Option<&Name>) -> String {
    name.map_or_else(|| format!("surface {entity}"), |name| format!("{name} ({entity})"))
}

fn gather(world: &mut World, entity: Entity) -> Option<Subject> {
    let of = world.get_entity(entity).ok()?;
    let surface = of.get::<CrackSurface>()?.clone();
    let preset = match &surface.preset {
        PresetSource::Inline(_) => None,
        PresetSource::Asset(handle) => world.get_resource::<Assets<CrackPreset>>()?.get(handle).cloned(),
    };
    let shards = of.get::<CrackShards>().map(|shards| (shards.shown, shards.gone, shards.pieces.len() as u32));
    let textures = of.get::<CrackTextures>().cloned().unwrap_or_default();
    Some(Subject {
        name: label(entity, of.get::<Name>()),
        surface,
        preset,
        state: of.get::<CrackState>().cloned().unwrap_or_default(),
        clock: of.get::<CrackClock>().copied(),
        guided: of.get::<GuidedCracks>().cloned(),
        strands: of.get::<CrackStrands>().cloned(),
        relief: of.get::<CrackRelief>().cloned(),
        relief_progress: of.get::<ReliefProgress>().map_or(0.0, |progress| progress.0),
        analogy: analogy_of(world, entity),
        analogy_progress: of.get::<AnalogyProgress>().map_or(0.0, |progress| progress.0),
        progress: of.get::<BakeProgress>().cloned(),
        shatter: of.get::<ShatterCracks>().cloned(),
        chips: of.get::<CrackChips>().cloned(),
        shards,
        textures: show_textures(world, &textures),
    })
}

/// The analogy of a surface as values.
fn analogy_of(world: &World, entity: Entity) -> Option<AnalogyChoice> {
    let CrackAnalogy { examples, keeps_picture, seed } = world.get::<CrackAnalogy>(entity)?;
    let file = examples.path().map(ToString::to_string).unwrap_or_default();
    Some(AnalogyChoice { file, keeps_picture: *keeps_picture, seed: *seed })
}

/// Gives a surface another analogy.
fn put_analogy(world: &mut World, entity: Entity, choice: Option<AnalogyChoice>) {
    let analogy = choice.and_then(|AnalogyChoice { file, keeps_picture, seed }| {
        let known = world.get::<CrackAnalogy>(entity).filter(|_| file.is_empty()).map(|known| known.examples.clone());
        let load = || Some(world.get_resource::<AssetServer>()?.load(file.trim().to_owned()));
        Some(CrackAnalogy { examples: known.or_else(load)?, keeps_picture, seed })
    });
    let Ok(mut to) = world.get_entity_mut(entity) else { return };
    match analogy {
        Some(analogy) => _ = to.insert(analogy),
        None => _ = to.remove::<CrackAnalogy>(),
    }
}

/// Lets egui show the textures of a surface.
fn show_textures(world: &mut World, textures: &CrackTextures) -> Vec<(&'static str, egui::TextureId, UVec2)> {
    let named = ["diffuse", "normal", "depth", "emissive"].into_iter().zip(textures.all());
    let mut shown = Vec::new();
    for (name, handle) in named {
        let Some(handle) = handle else { continue };
        let Some(size) = world.get_resource::<Assets<Image>>().and_then(|images| images.get(handle)).map(Image::size)
        else {
            continue;
        };
        if let Some(mut known) = world.get_resource_mut::<EguiUserTextures>() {
            shown.push((name, known.add_image(EguiTextureHandle::Weak(handle.id())), size));
        }
    }
    shown
}

fn costs(world: &mut World) -> Costs {
    let cost = inspect::frame_cost(world);
    let uploads = world.get_resource::<CrackUploadStats>().copied().unwrap_or_default();
    Costs {
        milliseconds: cost.milliseconds,
        budget: inspect::budget(world),
        bytes: uploads.bytes,
        rects: uploads.rects,
        nodes: cost.nodes,
        cracked: cost.cracked,
        texture_bytes: cost.texture_bytes,
    }
}

fn settings(subject: &Subject) -> Settings {
    Settings {
        surface: subject.surface.clone(),
        guided: subject.guided.clone(),
        strands: subject.strands.clone(),
        relief: subject.relief.clone(),
        analogy: subject.analogy.clone(),
        shatter: subject.shatter.clone(),
        chips: subject.chips.clone(),
        clock: subject.clock,
    }
}

/// The settings that a surface has now.
fn settings_of(world: &World, entity: Entity) -> Option<Settings> {
    let of = world.get_entity(entity).ok()?;
    Some(Settings {
        surface: of.get::<CrackSurface>()?.clone(),
        guided: of.get().cloned(),
        strands: of.get().cloned(),
        relief: of.get().cloned(),
        analogy: analogy_of(world, entity),
        shatter: of.get().cloned(),
        chips: of.get().cloned(),
        clock: of.get().copied(),
    })
}

/// Puts settings on a surface: only what has changed.
fn put(world: &mut World, entity: Entity, before: &Settings, after: Settings) {
    let Settings { surface, guided, strands, relief, analogy, shatter, chips, clock } = after;
    if before.analogy != analogy {
        put_analogy(world, entity, analogy);
    }
    put_one(world, entity, Some(&before.surface), Some(surface));
    put_one(world, entity, before.guided.as_ref(), guided);
    put_one(world, entity, before.strands.as_ref(), strands);
    put_one(world, entity, before.relief.as_ref(), relief);
    put_one(world, entity, before.shatter.as_ref(), shatter);
    put_one(world, entity, before.chips.as_ref(), chips);
    put_one(world, entity, before.clock.as_ref(), clock);
}

fn put_one<C: Component<Mutability = Mutable> + PartialEq>(
    world: &mut World,
    entity: Entity,
    before: Option<&C>,
    after: Option<C>,
) {
    if before == after.as_ref() {
        return;
    }
    let Ok(mut to) = world.get_entity_mut(entity) else { return };
    match after {
        Some(after) => match to.get_mut::<C>() {
            Some(mut component) => *component = after,
            None => {
                to.insert(after);
            }
        },
        None => {
            to.remove::<C>();
        }
    }
}

/// Does what a button asks for.
fn obey(world: &mut World, editor: &mut CrackEditor, command: EditorCommand) {
    let Some(entity) = editor.chosen else { return };
    match command {
        EditorCommand::Choose(other) => editor.chosen = Some(other),
        EditorCommand::Hit(uv) => world.trigger(CrackHit::uv(entity, uv).with_energy(editor.panel.energy)),
        EditorCommand::Heal => drop(world.commands().entity(entity).heal_cracks()),
        EditorCommand::Close(seconds) => drop(world.commands().entity(entity).close_cracks(seconds)),
        EditorCommand::Shatter(request) => drop(world.commands().entity(entity).shatter_cracks(request)),
        EditorCommand::Undo => step(world, editor, true),
        EditorCommand::Redo => step(world, editor, false),
        EditorCommand::SavePreset(path) => editor.panel.message = export::save_preset(world, entity, &path),
        EditorCommand::LoadRecord(path) => editor.panel.message = export::load_record(world, entity, &path),
        EditorCommand::Export(what, folder) => match export::start(world, entity, what, folder) {
            Ok(task) => {
                editor.panel.message = "Writing …".into();
                editor.exports.push(task);
            }
            Err(reason) => editor.panel.message = reason,
        },
    }
    world.flush();
}

/// Goes back or forth in the history; surfaces that are gone are passed over.
fn step(world: &mut World, editor: &mut CrackEditor, is_undo: bool) {
    while let Some(entity) = editor.history.next(is_undo) {
        let Some(now) = settings_of(world, entity) else {
            editor.history.drop_next(is_undo);
            continue;
        };
        if let Some(to) = editor.history.step(is_undo, now.clone()) {
            // Time is not part of it.
            put(world, entity, &now, Settings { clock: now.clock, ..to });
            editor.chosen = Some(entity);
        }
        return;
    }
}

/// Takes what finished exports say.
fn collect_exports(editor: &mut CrackEditor) {
    let panel = &mut editor.panel;
    editor.exports.retain_mut(|task| match block_on(future::poll_once(task)) {
        Some(message) => {
            panel.message = message;
            false
        }
        None => true,
    });
}
