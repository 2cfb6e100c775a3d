// Places in a disc of diameter 1, none near another.
fn shadow_pattern(k: i32) -> vec2f {
    var places = array<vec2f, SHADOW_SPREAD * SHADOW_SPREAD>({PLACES});
    return places[k];
}
