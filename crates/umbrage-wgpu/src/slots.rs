//! The places of the maps in the depth texture, from frame to frame.

use crate::{Error, Layout, Support};
use umbrage::visibility::Filter;
use umbrage::{Atlas, Place, Plan};

/// An atlas in which maps keep their places while they fit.
///
/// The sizes of a plan's maps change a little whenever the camera moves. Packing them anew each
/// frame would cost time and memory, and would move maps that could keep their places. Each map
/// therefore has a slot, and the maps are packed anew only when one outgrows its slot or the slots
/// waste too much. The first packing is exact, because sizes may never change. From the second
/// packing on, slots have room for their maps to grow.
#[derive(Debug, Default)]
pub(crate) struct Slots {
    /// Its places are as large as the slots.
    atlas: Atlas,
    /// The places of the maps themselves, which may be smaller than their slots.
    places: Vec<Option<Place>>,
    was_packed: bool,
    sizes: Vec<[u32; 2]>,
}

/// A slot with room is larger than its map by at least one part in this many.
const ROOM: u32 = 8;
/// An atlas is packed anew if its slots have more than this many times the texels that their maps
/// need.
const WASTE: u64 = 4;

impl Slots {
    /// The places of the maps in the order of the plan; `None` for empty maps.
    pub(crate) fn places(&self) -> &[Option<Place>] {
        &self.places
    }

    /// The size in texels, and the number of layers, of the texture that holds the maps.
    pub(crate) fn size(&self) -> ([u32; 2], u32) {
        (self.atlas.size, self.atlas.layers)
    }

    /// Finds a place for each map; `true` if the maps were packed anew.
    pub(crate) fn place(
        &mut self,
        plan: &Plan,
        layout: Layout,
        filter: &Filter,
        support: &Support,
    ) -> Result<bool, Error> {
        self.sizes.clear();
        self.sizes.extend(plan.maps.iter().map(|m| m.resolution));
        let moves = !self.holds_all() || self.wastes();
        if moves {
            // If slots with room do not fit, slots without room may.
            let roomy = self.was_packed.then(|| self.pack(layout, true, filter, support));
            self.atlas = match roomy {
                Some(Ok(atlas)) => atlas,
                _ => self.pack(layout, false, filter, support)?,
            };
            self.was_packed = true;
        }
        let sizes = self.sizes.iter().zip(&self.atlas.places);
        let places = sizes.map(|(&size, slot)| {
            slot.filter(|_| !size.contains(&0)).map(|slot| Place { size, ..slot })
        });
        self.places.clear();
        self.places.extend(places);
        Ok(moves)
    }

    fn holds_all(&self) -> bool {
        let fits = |(size, slot): (&[u32; 2], &Option<Place>)| {
            let room = slot.map_or([0; 2], |s| s.size);
            size.contains(&0) || (size[0] <= room[0] && size[1] <= room[1])
        };
        self.sizes.len() == self.atlas.places.len()
            && self.sizes.iter().zip(&self.atlas.places).all(fits)
    }

    fn wastes(&self) -> bool {
        let texels = |[w, h]: [u32; 2]| u64::from(w) * u64::from(h);
        let slots = self.sizes.iter().zip(&self.atlas.places);
        // Empty maps do not count, because they may be empty only for a moment and keep their
        // slots.
        let full =
            slots.filter_map(|(&size, slot)| (!size.contains(&0)).then_some((size, (*slot)?)));
        let [needed, taken] = full.fold([0, 0], |[needed, taken], (size, slot)| {
            [needed + texels(size), taken + texels(slot.size)]
        });
        taken > WASTE * needed
    }

    fn pack(
        &self,
        layout: Layout,
        with_room: bool,
        filter: &Filter,
        support: &Support,
    ) -> Result<Atlas, Error> {
        let max_side = support.max_side;
        let gutter = filter.reach_texels();
        // A slot has the sides of the drawn rectangle less both gutters, so that all maps begin at
        // multiples of the largest mip level's texel.
        let roomy = |n: u32| {
            let most = max_side.saturating_sub(2 * gutter).max(n);
            (n + n.div_ceil(ROOM)).min(most)
        };
        let slot = |size: [u32; 2]| match size {
            size if size.contains(&0) => size,
            size if with_room => filter.slot_texels(size.map(roomy)),
            size => filter.slot_texels(size),
        };
        let slots: Vec<[u32; 2]> = self.sizes.iter().copied().map(slot).collect();
        let fits = layout == Layout::Atlas || slots.len() <= support.max_layers as usize;
        if !fits {
            return Err(Error::Invalid {
                field: "options.layout",
                problem: format!(
                    "{} maps do not fit into {} layers: take `Layout::Atlas`",
                    slots.len(),
                    support.max_layers
                ),
            });
        }
        Ok(match layout {
            Layout::Atlas => Atlas::packed_sizes(&slots, gutter, max_side)?,
            Layout::Layers => Atlas::layered_sizes(&slots, gutter, max_side)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbrage::ShadowMap;
    use umbrage::visibility::statistic::{Statistic, Vsm};
    use umbrage::visibility::{Blur, Prefilter, Width};

    const SUPPORT: Support = Support { max_side: 1024, max_layers: 4, ..Support::FULL };

    /// This filter has gutters of two texels.
    const PCF3: Filter = Filter::Pcf { n: 3 };

    #[test]
    fn copies_of_half_the_size_keep_maps_apart() {
        let statistic = Statistic::Vsm(Vsm::default());
        let blur = Blur::Width(Width::Metres(1.0));
        let filter = Filter::Prefiltered(Prefilter { statistic, blur, half: false });
        let mut slots = Slots::default();
        let sizes = [[100, 201], [31, 77], [65, 33], [1, 1]];
        slots.place(&plan(&sizes), Layout::Atlas, &filter, &SUPPORT).unwrap();
        let (size, _) = slots.size();
        assert!(size.iter().all(|n| n.is_multiple_of(32)), "{size:?}");
        for (place, size) in slots.places().iter().zip(sizes) {
            let place = place.unwrap();
            assert_eq!(place.size, size);
            assert!(place.origin.iter().all(|n| n.is_multiple_of(32)), "{place:?}");
        }
    }

    fn plan(sizes: &[[u32; 2]]) -> Plan {
        let map = |&resolution: &[u32; 2]| ShadowMap { resolution, ..ShadowMap::default() };
        Plan { maps: sizes.iter().map(map).collect(), ..Plan::default() }
    }

    fn place(slots: &mut Slots, sizes: &[[u32; 2]]) -> bool {
        slots.place(&plan(sizes), Layout::Atlas, &PCF3, &SUPPORT).unwrap()
    }

    #[test]
    fn maps_stay_where_they_are_while_they_fit() {
        let mut slots = Slots::default();
        assert!(place(&mut slots, &[[100, 200], [0, 0], [64, 64]]));
        assert!(!place(&mut slots, &[[100, 200], [0, 0], [64, 64]]));
        assert!(!place(&mut slots, &[[90, 180], [0, 0], [50, 64]]));
        assert_eq!(slots.places()[0].unwrap().size, [90, 180]);
        assert_eq!(slots.places()[1], None);
        // The sizes have just changed, so slots have room from now on.
        assert!(place(&mut slots, &[[101, 200], [0, 0], [64, 64]]));
        let before = slots.places().to_vec();
        assert!(!place(&mut slots, &[[110, 210], [0, 0], [64, 70]]));
        let origins =
            |p: &[Option<Place>]| p.iter().map(|p| p.map(|p| p.origin)).collect::<Vec<_>>();
        assert_eq!(origins(slots.places()), origins(&before));
        // An empty map keeps its slot.
        assert!(!place(&mut slots, &[[0, 0], [0, 0], [64, 70]]));
        assert!(!place(&mut slots, &[[110, 210], [0, 0], [64, 70]]));
        assert!(place(&mut slots, &[[110, 210], [8, 8], [64, 70]]));
    }

    #[test]
    fn room_is_given_up_where_there_is_none_and_waste_is_taken_back() {
        let mut slots = Slots::default();
        assert!(place(&mut slots, &[[8, 8]]));
        assert!(place(&mut slots, &[[1020, 1020]]));
        assert_eq!(slots.size(), ([1024, 1024], 1));
        assert!(place(&mut slots, &[[100, 100]]));
        assert!(slots.size().0[0] < 200);
    }

    #[test]
    fn what_cannot_fit_is_an_error() {
        let mut slots = Slots::default();
        let error = slots.place(&plan(&[[1022, 8]]), Layout::Atlas, &PCF3, &SUPPORT).unwrap_err();
        assert!(error.to_string().contains("no room for 1 shadow maps"), "{error}");
        let five = plan(&[[8, 8]; 5]);
        let error = slots.place(&five, Layout::Layers, &PCF3, &SUPPORT).unwrap_err();
        assert!(error.to_string().contains("5 maps do not fit into 4 layers"), "{error}");
        assert!(slots.place(&five, Layout::Atlas, &PCF3, &SUPPORT).unwrap());
    }
}
