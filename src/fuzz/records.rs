//! What has happened to a growth, as a saved game has it.

use super::{Input, run};
use crate::{
    CrackPreset,
    growth::{CrackGrowth, GrowthParams, Past, PastEvent},
};
use glam::Vec2;

/// The most events of a case.
const MOST_EVENTS: usize = 24;

/// A file: the text itself, or a past of any numbers.
fn past(bytes: &[u8]) -> Option<Past> {
    if bytes.first().is_none_or(|&first| first == b'(') {
        return ron::from_str(&String::from_utf8_lossy(bytes)).ok();
    }
    let input = &mut Input::new(bytes);
    let extent = Vec2::new(input.mostly(0.25, 4.0, 32), input.mostly(0.25, 4.0, 32));
    let mut last = 0u32;
    let events = (0..input.below(MOST_EVENTS as u32))
        .map(|_| {
            last = if input.once_in(48) { input.word() } else { last.saturating_add(input.below(40)) };
            if input.once_in(6) {
                PastEvent::Removal { after: last, keep: input.below(500) }
            } else {
                PastEvent::Hit { after: last, pos: input.place(extent, 48), energy: input.mostly(0.05, 2.0, 48) }
            }
        })
        .collect();
    let steps = if input.once_in(16) { input.word() } else { last.saturating_add(input.below(60)) };
    let past = Past { extent, events, steps };
    let text = ron::to_string(&past).unwrap();
    let read = ron::from_str::<Past>(&text).unwrap();
    assert_eq!(ron::to_string(&read).unwrap(), text);
    Some(read)
}

fn target(bytes: &[u8]) {
    let Some(mut past) = past(bytes) else { return };
    past.events.truncate(MOST_EVENTS);
    let is_sound = past.validate().is_ok();
    let name = CrackPreset::NAMES[bytes.len() % CrackPreset::NAMES.len()];
    let params = GrowthParams { max_nodes: 400, ..CrackPreset::named(name).unwrap().growth };
    let begin = || CrackGrowth::new(params.clone(), Vec2::new(1.5, 1.0), 7).unwrap();
    // Who does not check it gets no cracks or some, but no panic.
    let mut growth = begin();
    growth.replay(&past);
    assert!(growth.network().nodes().len() <= 400);
    let lived = growth.past().unwrap();
    assert_eq!(lived.validate(), Ok(()));
    assert!(lived.events.len() <= past.events.len());
    let mut again = begin();
    again.replay(&lived);
    assert_eq!(again.network(), growth.network(), "{name}: {lived:?}");
    if is_sound {
        let both = past.followed_by(&past);
        assert_eq!(both.events.len(), 2 * past.events.len());
        if u64::from(past.steps) * 2 <= u64::from(u32::MAX) {
            assert_eq!(both.validate(), Ok(()));
        }
    }
}

#[test]
fn records() {
    run("records", 300, target);
}
