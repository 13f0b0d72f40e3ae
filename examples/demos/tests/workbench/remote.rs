//! Hits by HTTP, as any tool that speaks the engine's remote protocol sends them.

use crate::{app, state, wait_for};
use bevy::{
    prelude::*,
    remote::{RemotePlugin, http::RemoteHttpPlugin},
};
use bevy_crack::prelude::*;
use serde_json::{Value, json};
use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    thread,
};

/// A port that nobody uses.
fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address").port()
}

/// What a plain HTTP client is answered.
fn post(port: u16, body: &str) -> Result<Value, String> {
    let text = |error: std::io::Error| error.to_string();
    let mut stream = TcpStream::connect(("127.0.0.1", port)).map_err(text)?;
    let head =
        format!("POST / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {}\r\n\r\n", body.len());
    stream.write_all((head + body).as_bytes()).map_err(text)?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).map_err(text)?;
    let body = answer.split_once("\r\n\r\n").ok_or("no body")?.1;
    // It may come in chunks, each behind its length.
    let start = body.find('{').ok_or_else(|| answer.clone())?;
    let end = body.rfind('}').ok_or("no end")?;
    serde_json::from_str(&body[start..=end]).map_err(|error| format!("{error}: {body}"))
}

/// Asks from another thread while frames go on.
fn ask(app: &mut App, port: u16, request: &Value) -> Value {
    let body = request.to_string();
    let asking = thread::spawn(move || {
        for _ in 0..200 {
            match post(port, &body) {
                Ok(answer) => return answer,
                // The server is not there yet.
                Err(_) => thread::sleep(std::time::Duration::from_millis(20)),
            }
        }
        post(port, &body).expect("an answer")
    });
    wait_for(app, "an answer", |_| asking.is_finished());
    asking.join().expect("an answer")
}

#[test]
fn a_hit_by_http_cracks_the_wall_and_nonsense_is_refused() {
    let port = free_port();
    let mut app = app(|app| {
        app.add_plugins((RemotePlugin::default(), RemoteHttpPlugin::default().with_port(port)));
    });
    let picture = app.world().resource::<AssetServer>().load("textures/plaster.png");
    let surface = CrackSurface::new(CrackPreset::PLASTER);
    let wall = app.world_mut().spawn((Sprite::from_image(picture), surface)).id();
    app.update();
    let request =
        |method: &str, params: Value| json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params });
    let hit = |value: Value| {
        request("world.trigger_event", json!({ "event": "bevy_crack::plugin::api::hit::CrackHit", "value": value }))
    };
    // Nonsense: an error each, and the wall is whole.
    for nonsense in [
        hit(json!({ "entity": "a wall" })),
        hit(json!({ "entity": wall.to_bits(), "at": { "Uv": [0.5] }, "energy": 1.0, "direction": [0.0, 0.0, 0.0] })),
        request("world.trigger_event", json!({ "event": "bevy_crack::NoSuchHit", "value": {} })),
        request("world.crack_everything", json!({})),
        request(
            "world.insert_components",
            json!({ "entity": wall.to_bits(), "components": { "bevy_crack::plugin::api::surface::CrackSurface": { "seed": "many" } } }),
        ),
    ] {
        let answer = ask(&mut app, port, &nonsense);
        assert!(answer["error"]["message"].is_string(), "{nonsense}: {answer}");
    }
    assert_eq!(state(&app, wall), CrackState::default());
    // A hit.
    let value =
        json!({ "entity": wall.to_bits(), "at": { "Uv": [0.5, 0.5] }, "energy": 1.5, "direction": [0.0, 0.0, -1.0] });
    let answer = ask(&mut app, port, &hit(value));
    assert!(answer["error"].is_null(), "{answer}");
    wait_for(&mut app, "cracks", |app| state(app, wall).status == CrackStatus::Done);
    assert!(state(&app, wall).nodes > 10);
    // A single number of the preset is changed by its path.
    let change = json!({
        "entity": wall.to_bits(),
        "component": "bevy_crack::plugin::api::surface::CrackSurface",
        "path": ".seed",
        "value": 77,
    });
    let answer = ask(&mut app, port, &request("world.mutate_components", change));
    assert!(answer["error"].is_null(), "{answer}");
    assert_eq!(app.world().get::<CrackSurface>(wall).expect("the surface").seed, 77);
}
