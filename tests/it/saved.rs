//! Surfaces as the engine's reflection sees them: registered, written by the plain serializer, and read again.

use crate::support::*;
use bevy::{
    asset::{HandleDeserializeProcessor, uuid::Uuid},
    ecs::reflect::AppTypeRegistry,
    prelude::*,
    reflect::{
        FromReflect, PartialReflect, ReflectFromReflect, TypeInfo, TypeRegistration, TypeRegistry,
        serde::{ReflectSerializer, TypedReflectDeserializer, TypedReflectSerializer},
        structs::DynamicStruct,
    },
};
use bevy_crack::{Grid, plugin::CrackTextures, prelude::*, voronoi::SiteLayout};
use serde::de::DeserializeSeed;
use serde_json::Value;
use std::sync::Arc;

/// The plain serializer, without any processor.
fn written(app: &App, value: &dyn PartialReflect) -> Value {
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let typed = serde_json::to_value(TypedReflectSerializer::new(value, &registry)).expect("it can be written");
    let named =
        serde_json::to_value(ReflectSerializer::new(value, &registry)).expect("it can be written with its name");
    assert_eq!(named.as_object().and_then(|named| named.values().next()), Some(&typed));
    typed
}

/// Reads it as the engine reads its worlds: handles are loaded.
fn read<T: FromReflect + Reflect + TypePath>(app: &App, value: &Value) -> T {
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let registration = registry.get(core::any::TypeId::of::<T>()).expect("it is registered");
    let mut server: &AssetServer = app.world().resource();
    let mut handles = HandleDeserializeProcessor { load_from_path: &mut server };
    let seed = TypedReflectDeserializer::with_processor(registration, &registry, &mut handles);
    let found = seed.deserialize(value).expect("it can be read");
    T::from_reflect(&*found).expect("it is one")
}

#[test]
fn a_surface_with_handles_is_written_and_read() {
    let app = app();
    let server = app.world().resource::<AssetServer>();
    let mask = |name: &str| Some(server.load::<Image>(format!("masks/{name}.png")));
    let images = CrackMaskSource::Images { weak: mask("weak"), strong: None, forbidden: mask("never") };
    let file: Handle<CrackPreset> = server.load("presets/mine.crack.ron");
    let inline = CrackPreset { steps_per_second: 3.0, ..CrackPreset::GLASS };
    let mut surfaces = vec![CrackSurface::default(), CrackSurface::new(inline).with_mask(CrackMaskSource::None)];
    surfaces.push(CrackSurface::new(file.clone()).with_seed(u64::MAX).with_mask(images));
    surfaces.push(CrackSurface::default().with_density(server.load("masks/dense.png")));
    let fixed = CrackResolution::Fixed(UVec2::new(7, 9));
    surfaces.push(CrackSurface::new(file).with_resolution(fixed).with_mask(CrackMaskSource::FromPicture));
    surfaces.push(CrackSurface::new(Handle::from(Uuid::from_u128(7))));
    for surface in surfaces {
        let value = written(&app, &surface);
        assert_eq!(read::<CrackSurface>(&app, &value), surface, "{value}");
    }
    let file = CrackSurface::new(server.load::<CrackPreset>("presets/mine.crack.ron"));
    let path = &written(&app, &file)["preset"]["Asset"]["Path"];
    assert_eq!(path, "presets/mine.crack.ron", "as the engine's own processor writes it");
    // What is in no file is left out.
    let mut app = app;
    let added = CrackSurface::new(add(&mut app, CrackPreset::GLASS));
    assert_eq!(read::<CrackSurface>(&app, &written(&app, &added)), CrackSurface::new(Handle::default()));
}

#[test]
fn guided_cracks_and_shatter_settings_are_written_and_read() {
    let app = app();
    let server = app.world().resource::<AssetServer>();
    let mut guided = GuidedCracks::new(CrackGuide::new(server.load::<Image>("sign.png")).with_gamma(3.0));
    guided.guides.push(CrackGuide::own_edges());
    guided.params.layout = SiteLayout::Given(vec![Vec2::new(0.25, 0.5)]);
    guided.appearance = GuidedAppearance::Front { from: Vec2::new(0.1, 0.2), seconds: 2.0 };
    let value = written(&app, &guided);
    assert_eq!(value["guides"][0]["source"]["Image"]["Path"], "sign.png");
    assert_eq!(read::<GuidedCracks>(&app, &value), guided);
    let grid = Grid::from_vec(UVec2::new(2, 1), vec![0.5, 1.0]).expect("two values");
    guided.params.layout = SiteLayout::Density(grid.clone());
    guided.guides.clear();
    let mut value = written(&app, &guided);
    assert_eq!(read::<GuidedCracks>(&app, &value), guided);
    // Values that do not fill a grid are none.
    value["params"]["layout"]["Density"]["data"] = serde_json::json!([0.5, 1.0, 0.25]);
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let registration = registry.get(core::any::TypeId::of::<GuidedCracks>()).expect("it is registered");
    let found = TypedReflectDeserializer::new(registration, &registry).deserialize(&value);
    assert!(found.is_err_and(|error| error.to_string().contains("3 values for a grid of [2, 1]")));
    // What is shared in memory is written out.
    for (source, name) in [(GuideSource::Grid(Arc::new(grid)), "Grid"), (GuideSource::Png(Arc::from([1, 2])), "Png")] {
        let value = written(&app, &GuidedCracks::new(CrackGuide::new(source)));
        assert!(
            value["guides"][0]["source"][name].is_object() || value["guides"][0]["source"][name].is_array(),
            "{value}"
        );
    }

    let inside = server.load::<StandardMaterial>("wall.gltf#Material0");
    let shatter =
        ShatterCracks { inside: Some(inside), when: ShatterWhen::AtDamage(0.25), seek: Some(2.0), ..default() };
    for shatter in [shatter, ShatterCracks::default()] {
        assert_eq!(read::<ShatterCracks>(&app, &written(&app, &shatter)), shatter);
    }
}

/// All that is on a surface that has cracked and shattered can be written; what the crate writes itself is left out.
#[test]
fn a_surface_in_use_is_written() {
    let mut app = app();
    let entity = crate::shards::cracked(&mut app, UVec2::splat(64), crate::shards::loose());
    crate::shards::shatter(&mut app, entity, ShatterRequest::ALL);
    let shard = crate::shards::shards(&mut app)[0];
    assert_eq!(written(&app, &get::<CrackTextures>(&app, entity)), serde_json::json!({}));
    written(&app, &state(&app, entity));
    let told: CrackShards = get(&app, entity);
    assert_eq!(written(&app, &told)["gone"], told.gone);
    let shard: Shard = get(&app, shard);
    let value = written(&app, &shard);
    assert_eq!(value["number"], shard.number);
    let again = read::<Shard>(&app, &value);
    assert_eq!((again.surface, again.number, again.velocity), (shard.surface, shard.number, shard.velocity));
    assert!(again.pieces.is_empty() && again.area() == 0.0 && again.convex_pieces(0.0).is_empty());
}

#[test]
fn what_games_look_into_is_registered() {
    let app = app();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    fn info<T: 'static>(registry: &TypeRegistry) -> &'static TypeInfo {
        registry.get_type_info(core::any::TypeId::of::<T>()).expect("it is registered")
    }
    let fields = |info: &TypeInfo| match info {
        TypeInfo::Struct(info) => info.iter().map(|field| field.name()).collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    };
    assert_eq!(fields(info::<GuidedCracks>(&registry)), ["guides", "params", "seed", "appearance", "max_side"]);
    assert_eq!(fields(info::<Shard>(&registry)), ["surface", "number", "velocity", "spin", "scale"]);
    assert_eq!(fields(info::<CrackShards>(&registry)), ["gone", "shown", "time"]);
    assert!(matches!(info::<GuidedAppearance>(&registry), TypeInfo::Enum(_)));
    for type_id in [core::any::TypeId::of::<Shard>(), core::any::TypeId::of::<CrackShards>()] {
        assert!(registry.get_type_data::<ReflectComponent>(type_id).is_some());
    }
}

/// All types of the crate that tools may write into a world.
fn writable(registry: &TypeRegistry) -> Vec<&TypeRegistration> {
    let all = registry.iter().filter(|registration| registration.type_info().type_path().starts_with("bevy_crack::"));
    all.filter(|registration| {
        registration.data::<ReflectComponent>().is_some()
            || registration.data::<ReflectEvent>().is_some()
            || registration.data::<ReflectResource>().is_some()
    })
    .collect()
}

/// Editors and remote tools may leave any field out: there is a default for it, or the engine's reflection would panic.
#[test]
fn tools_may_leave_fields_out() {
    let app = app();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let writable = writable(&registry);
    assert!(writable.len() >= 18, "{}", writable.len());
    for registration in writable {
        let path = registration.type_info().type_path();
        assert!(registration.data::<ReflectDefault>().is_some(), "{path} has no default");
        if let (TypeInfo::Struct(_), Some(from)) = (registration.type_info(), registration.data::<ReflectFromReflect>())
        {
            assert!(from.from_reflect(&DynamicStruct::default()).is_some(), "{path} cannot be made from nothing");
        }
    }
}

/// A hit as the engine's remote protocol reads and triggers it (`world.trigger_event`).
#[test]
fn a_hit_from_json_cracks_the_wall_and_nonsense_does_not() {
    let mut app = app();
    let wall = spawn_picture(&mut app, UVec2::splat(64));
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let trigger = |app: &mut App, value: Value| {
        let registry = registry.read();
        let hit = registry.get(core::any::TypeId::of::<CrackHit>()).expect("it is registered");
        let event = TypedReflectDeserializer::new(hit, &registry).deserialize(value).map_err(|e| e.to_string())?;
        let triggers = hit.data::<ReflectEvent>().expect("it is an event");
        triggers.trigger(app.world_mut(), &*event, &registry);
        Ok::<(), String>(())
    };
    for nonsense in [
        serde_json::json!({ "entity": "a wall" }),
        serde_json::json!({ "entity": wall.to_bits(), "at": { "Uv": [0.5] } }),
        serde_json::json!({ "entity": wall.to_bits(), "at": { "Nowhere": 1 } }),
        serde_json::json!({ "entity": wall.to_bits(), "force": 1.0 }),
    ] {
        assert!(trigger(&mut app, nonsense.clone()).is_err(), "{nonsense}");
    }
    // Read, but refused or about nobody.
    for useless in [
        serde_json::json!({}),
        serde_json::json!({ "entity": wall.to_bits(), "at": { "Uv": [7.0, 0.5] } }),
        serde_json::json!({ "entity": wall.to_bits(), "energy": 0.0 }),
    ] {
        assert_eq!(trigger(&mut app, useless), Ok(()));
    }
    steps(&mut app, 3);
    assert_eq!(state(&app, wall).status, CrackStatus::Untouched);
    let value = serde_json::json!({ "entity": wall.to_bits(), "at": { "Uv": [0.5, 0.5] }, "energy": 2.0 });
    assert_eq!(trigger(&mut app, value), Ok(()));
    settle(&mut app, wall);
    assert!(state(&app, wall).nodes > 0);
    let stats = counts(&app);
    assert_eq!((stats.sent, stats.applied, stats.ignored, stats.rejected), (4, 1, 1, 2));
}
