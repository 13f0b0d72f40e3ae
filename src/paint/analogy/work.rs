//! [`Work`]: what is done for one change, level by level, pass by pass, span by span.

use super::{
    atlas::Atlas,
    examples::Examples,
    guide::GuideWork,
    level::Level,
    region::{Region, Span},
    search::Search,
};
use crate::math::{mix, vectorized};
use glam::{IVec2, UVec2};

/// Levels that are made anew where a guide has changed: a new crack is first put in at a quarter of the size.
const LEVELS_OF_A_CHANGE: usize = 3;

/// Texels around a change that are made anew on the smaller levels.
const MARGIN_OF_LEVELS: u32 = 2;

/// Random places for each texel, times those of other levels, where nothing has been found yet.
const MORE_AT_FIRST: u32 = 8;

#[derive(Clone, Debug)]
pub(super) struct Work {
    /// Whether all texels are made anew, not only those near a changed guide.
    is_whole: bool,
    guide: Option<GuideWork>,
    /// Texels to make on each level.
    regions: Vec<Region>,
    level: usize,
    /// 0 = the places of the level before are taken over.
    pass: u32,
    /// Spans of the pass that are done.
    spans: usize,
    done: u64,
    total: u64,
}

impl Work {
    pub(super) fn new(guide: GuideWork, is_whole: bool, level_count: usize) -> Self {
        // Until it is known how much has changed, the guide is a small part of the work.
        let total = guide.left().max(1) * 8;
        let top = if is_whole { level_count } else { level_count.min(LEVELS_OF_A_CHANGE) } - 1;
        Self { is_whole, guide: Some(guide), regions: Vec::new(), level: top, pass: 0, spans: 0, done: 0, total }
    }

    /// Share of the work that is done, 0..=1.
    pub(super) fn progress(&self) -> f32 {
        (self.done as f32 / self.total as f32).min(1.0)
    }

    /// Does the next part. Returns the number of texels that were visited, `None` if there is nothing left.
    pub(super) fn step(
        &mut self,
        levels: &mut [Level],
        cracks: &[bool],
        examples: &Examples,
        seed: u64,
    ) -> Option<u64> {
        if let Some(guide) = &mut self.guide {
            let full = levels.first_mut()?;
            if let Some(visited) = guide.step(full, cracks, examples) {
                self.done += visited;
                return Some(visited);
            }
            let guide = self.guide.take()?;
            let changed = guide.finish(levels, examples);
            self.begin(&changed, levels, examples);
        }
        let span = loop {
            let spans = self.regions.get(self.level)?.spans();
            if let Some(&span) = spans.get(self.spans) {
                let last = spans.len() - 1 - self.spans;
                self.spans += 1;
                break if self.is_backward() { spans[last] } else { span };
            }
            self.spans = 0;
            if self.pass < self.passes(examples) {
                self.pass += 1;
            } else if self.level > 0 {
                (self.level, self.pass) = (self.level - 1, 0);
            } else {
                return None;
            }
        };
        self.work_on(span, levels, examples, seed);
        let visited = u64::from(span.end - span.start);
        self.done += visited;
        Some(visited)
    }

    /// The texels at full size that this makes.
    pub(super) fn region(&self) -> &Region {
        const NONE: &Region = &Region::NONE;
        self.regions.first().unwrap_or(NONE)
    }

    const fn is_backward(&self) -> bool {
        self.pass > 0 && self.pass.is_multiple_of(2)
    }

    fn top(&self) -> usize {
        self.regions.len() - 1
    }

    fn passes(&self, examples: &Examples) -> u32 {
        // Where nothing is known yet more passes are needed.
        examples.params.passes + if self.level == self.top() { 2 } else { 0 }
    }

    /// Decides what is to be made.
    fn begin(&mut self, changed: &Region, levels: &mut [Level], examples: &Examples) {
        let mut region = changed.clone();
        for (at, level) in levels.iter_mut().enumerate().take(self.level + 1) {
            if at > 0 {
                region = region.halved();
            }
            let by = if at == 0 { examples.params.margin } else { MARGIN_OF_LEVELS };
            let all = if self.is_whole { Region::whole(level.size) } else { region.grown(by, level.size, level.wraps) };
            for span in all.spans() {
                let start = level.index(UVec2::new(span.start, span.y));
                level.is_new[start..start + (span.end - span.start) as usize].fill(false);
            }
            self.regions.push(all);
        }
        let visits = |(at, region): (usize, &Region)| {
            let passes = examples.params.passes + 1 + if at == self.level { 2 } else { 0 };
            u64::from(passes) * region.area()
        };
        self.total = self.done + self.regions.iter().enumerate().map(visits).sum::<u64>().max(1);
    }

    fn work_on(&self, span: Span, levels: &mut [Level], examples: &Examples, seed: u64) {
        let (finer, coarser) = levels.split_at_mut(self.level + 1);
        let (Some(level), Some(atlas)) = (finer.last_mut(), examples.atlases.get(self.level)) else { return };
        let is_top = self.level == self.top();
        let more = if is_top { MORE_AT_FIRST } else { 1 };
        let search = Search {
            atlas,
            weights: &examples.weights,
            tries: examples.params.tries * more,
            seed: mix(seed ^ (self.level as u64) << 32 ^ u64::from(self.pass)),
        };
        if self.pass == 0 && is_top {
            if self.is_whole {
                for x in span.start..span.end {
                    let texel = UVec2::new(x, span.y);
                    let first = atlas.sheets.first().filter(|sheet| texel.cmplt(sheet.size).all());
                    search.begin(level, texel, first.map(|sheet| sheet.place(texel)));
                }
            }
        } else if self.pass == 0 {
            if let (Some(coarser), Some(above)) = (coarser.first(), examples.atlases.get(self.level + 1)) {
                take_over(span, level, coarser, &search, above);
            }
        } else {
            let is_backward = self.is_backward();
            vectorized(
                #[inline(always)]
                || {
                    for i in span.start..span.end {
                        let x = if is_backward { span.start + span.end - 1 - i } else { i };
                        search.improve(level, UVec2::new(x, span.y));
                    }
                },
            );
        }
    }
}

/// Gives texels the places that those of the coarser level have, where these are new: two by two, moved to where the
/// guide fits.
fn take_over(span: Span, level: &mut Level, coarser: &Level, search: &Search<'_>, above: &Atlas) {
    let atlas = search.atlas;
    let mut last = (u32::MAX, IVec2::ZERO);
    for x in span.start..span.end {
        let texel = UVec2::new(x, span.y);
        let parent = coarser.index(texel / 2);
        if !coarser.is_new[parent] {
            continue;
        }
        let (pair, from) = above.texel(coarser.places[parent]);
        let sheet = atlas.sheets[pair];
        if last.0 != x / 2 {
            last = (x / 2, search.alignment(level, texel / 2 * 2, sheet.place(2 * from)));
        }
        let place = sheet.place(2 * from + texel % 2);
        let place = atlas.moved(place, last.1).unwrap_or(place);
        let index = level.index(texel);
        level.is_new[index] = level.places[index] != place;
        level.put(index, place, atlas);
    }
}
