//! What `umbrage plan` prints of plans with pages.

use super::{LightJson, lights, name_among, side_name, sides, write_rows};
use crate::output::{aligned, print, six_digits};
use anyhow::Result;
use glam::DVec3;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use umbrage::paged::{Level, PAGE_AREA, PAGE_TEXELS, Page, Paging};
use umbrage::{Plan, ShadowMap};
use umbrage_lab::{ChosenLight, ChosenView, NamedTechnique};
use umbrage_measure::View;

#[derive(Serialize)]
struct PagedJson {
    /// One for each level and slab, light by light.
    levels: Vec<LevelJson>,
    /// Number of pages that the view needs; left out without a scene, like all counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pages: Option<usize>,
    /// Texels of these pages.
    #[serde(skip_serializing_if = "Option::is_none")]
    texels: Option<u64>,
    /// The most pages that there may be; `null` for as many as are needed.
    budget: Option<u32>,
    /// The greatest width of a texel that was asked for, pixels.
    error_px: f64,
    /// The greatest width of a texel that there is, which is larger where the pages did not fit.
    bound_px: f64,
    /// By how many levels receivers are looked up in coarser maps than the error asks for.
    bias: f64,
    /// Texels across a page, without its gutter.
    page_texels: u32,
    /// Width of the gutter around each page, texels.
    gutter: u32,
    /// Angle θ of the first light.
    theta_deg: f64,
    lights: Vec<LightJson>,
    /// The pages themselves, with `--pages`.
    #[serde(skip_serializing_if = "Option::is_none")]
    addresses: Option<Vec<PageJson>>,
    view: View,
}

#[derive(Serialize)]
struct LevelJson {
    /// Index of the light.
    light: usize,
    /// Side of the cube around a point light; `null` for other lights.
    side: Option<&'static str>,
    /// The base-two logarithm of a texel's width.
    level: i32,
    /// The width of a texel.
    #[serde(flatten)]
    texel: Texel,
    /// The slab of the level's receivers.
    slab: i64,
    /// Pages across the window of the level.
    window: u32,
    /// The first page of the window.
    first_page: [i64; 2],
    /// Range of distances along the view at which receivers have this level, as far as known.
    split: [f64; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    pages: Option<usize>,
}

/// The width of a texel.
#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "snake_case")]
enum Texel {
    /// Under parallel light, metres.
    TexelM(f64),
    /// Under a lamp, the tangent of an angle: the width at a distance of 1 m along the axis.
    TexelTangent(f64),
}

#[derive(Serialize)]
struct PageJson {
    light: usize,
    side: Option<&'static str>,
    level: i32,
    slab: i64,
    i: i64,
    j: i64,
    /// The four columns of the matrix of the page's own map.
    world_to_shadow: [[f64; 4]; 4],
}

/// A plan with pages, and its inputs.
pub(super) struct Paged<'a> {
    pub(super) technique: &'a NamedTechnique,
    pub(super) view: &'a ChosenView,
    pub(super) chosen_lights: &'a [ChosenLight],
    pub(super) plan: &'a Plan,
    pub(super) paging: &'a Paging,
    /// The world positions that the camera sees; `None` without a scene.
    pub(super) seen: Option<&'a [DVec3]>,
}

impl Paged<'_> {
    /// Prints JSON or a table. The pages are listed if `with_pages` is true.
    pub(super) fn print(&self, as_json: bool, with_pages: bool) -> Result<()> {
        match as_json {
            true => {
                let json = self.json(with_pages);
                print(&format!("{}\n", serde_json::to_string_pretty(&json)?))
            }
            false => print(&self.table(with_pages)),
        }
    }

    /// The pages that the view needs, in the order of their levels; `None` without a scene.
    fn pages(&self) -> Option<Vec<Page>> {
        let seen = self.seen?;
        let of_light = |light| self.plan.wanted_pages(light, seen);
        Some((0..self.plan.lights.len()).flat_map(of_light).collect())
    }

    fn json(&self, with_pages: bool) -> PagedJson {
        let Self { plan, paging, .. } = self;
        let pages = self.pages();
        let counts = pages.as_deref().map(counts);
        let levels = paging.levels.iter().zip(&plan.maps).map(|(level, map)| LevelJson {
            light: map.part.light,
            side: map.part.side.map(side_name),
            level: level.level,
            texel: texel(level, map),
            slab: level.slab,
            window: level.side,
            first_page: level.first_page,
            split: map.split,
            pages: counts.as_ref().map(|counts| count(counts, level)),
        });
        let page = |page: &Page| {
            let map = plan.page_map(page)?;
            let Page { level, slab, i, j, .. } = *page;
            let (light, side) = (map.part.light, map.part.side.map(side_name));
            let world_to_shadow = map.shadow_from_world().to_cols_array_2d();
            Some(PageJson { light, side, level, slab, i, j, world_to_shadow })
        };
        PagedJson {
            levels: levels.collect(),
            pages: pages.as_ref().map(Vec::len),
            texels: pages.as_ref().map(|pages| texels_of(pages.len())),
            budget: paging.budget,
            error_px: paging.error,
            bound_px: paging.bound(),
            bias: paging.bias,
            page_texels: PAGE_TEXELS,
            gutter: plan.filter.reach_texels(),
            theta_deg: plan.lights[0].theta_rad.to_degrees(),
            lights: lights(plan, self.chosen_lights),
            addresses: pages.filter(|_| with_pages).map(|p| p.iter().filter_map(page).collect()),
            view: self.view.info(),
        }
    }

    fn table(&self, with_pages: bool) -> String {
        let Self { technique, plan, paging, .. } = self;
        let pages = self.pages();
        let counts = pages.as_deref().map(counts);
        let mut text = format!("shadows         {technique}\n");
        // Writing to a string cannot fail.
        let mut line = |l: std::fmt::Arguments<'_>| {
            let _ = writeln!(text, "{l}");
        };
        for (light, chosen) in plan.lights.iter().zip(self.chosen_lights) {
            let name = name_among(chosen, self.chosen_lights);
            line(format_args!("view and {name:<6} {:.2}° apart", light.theta_rad.to_degrees()));
        }
        line(format_args!("pixels a texel  {} at most", six_digits(paging.bound())));
        if let Some(pages) = &pages {
            let of = paging.budget.map_or(String::new(), |budget| format!(" of {budget}"));
            line(format_args!("pages           {}{of}, {PAGE_TEXELS} texels wide", pages.len()));
            line(format_args!("texels          {}", texels_of(pages.len())));
        }
        let mut rows = vec![
            ["level", "texel", "light", "slab", "window", "pages"].map(str::to_owned).to_vec(),
        ];
        for (level, map) in paging.levels.iter().zip(&plan.maps) {
            let pages = counts.as_ref().map(|counts| count(counts, level));
            if pages == Some(0) {
                continue;
            }
            let width = match texel(level, map) {
                Texel::TexelM(width) => format!("{} m", six_digits(width)),
                Texel::TexelTangent(width) => format!("{}", six_digits(width)),
            };
            rows.push(vec![
                level.level.to_string(),
                width,
                match map.part.side {
                    Some(side) => side_name(side),
                    None => name_among(&self.chosen_lights[map.part.light], self.chosen_lights),
                }
                .to_owned(),
                level.slab.to_string(),
                sides([level.side; 2]),
                pages.map_or("-".into(), |pages| pages.to_string()),
            ]);
        }
        line(format_args!("\n{}", aligned(&rows)));
        for page in pages.iter().flatten().filter(|_| with_pages) {
            let Some(map) = plan.page_map(page) else { continue };
            let Page { level, slab, i, j, .. } = page;
            let side = map.part.side.map_or(String::new(), |s| format!("side {}, ", side_name(s)));
            line(format_args!("page {i},{j} of level {level}: {side}slab {slab}"));
            line(format_args!("  shadow_from_world (rows)"));
            write_rows(&map, &mut line);
        }
        text
    }
}

/// Numbers of pages by grid, level and slab.
fn counts(pages: &[Page]) -> BTreeMap<(usize, i32, i64), usize> {
    let mut counts = BTreeMap::new();
    for page in pages {
        *counts.entry((page.grid, page.level, page.slab)).or_default() += 1;
    }
    counts
}

fn count(counts: &BTreeMap<(usize, i32, i64), usize>, level: &Level) -> usize {
    counts.get(&(level.grid, level.level, level.slab)).copied().unwrap_or_default()
}

fn texel(level: &Level, window: &ShadowMap) -> Texel {
    let width = f64::from(level.level).exp2();
    match window.apex {
        None => Texel::TexelM(width),
        Some(_) => Texel::TexelTangent(width),
    }
}

fn texels_of(pages: usize) -> u64 {
    pages as u64 * PAGE_AREA
}
