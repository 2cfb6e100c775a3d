use super::budget::Budget;
use super::{extensions, uri};
use crate::error::SceneError;
use crate::types::Notice;
use gltf::json::{Index, Node, Root, Value, deserialize, root::Get};
use std::borrow::Cow;
use std::fmt::Display;
use std::fs::Metadata;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A scene file's JSON, and the bytes that it refers to.
///
/// Indices in the JSON may be out of range. The crate `gltf` is used for its schema types only,
/// because its wrappers and readers panic on invalid files. All objects are looked up through
/// [`get`](Self::get).
pub(super) struct Document<'a> {
    pub(super) path: &'a Path,
    pub(super) root: Root,
    pub(super) budget: Budget<'a>,
    /// Whether the JSON begins with a byte order mark.
    pub(super) has_byte_order_mark: bool,
    /// In the order of the JSON. Each buffer has at least the length that the JSON states.
    buffers: Vec<Cow<'a, [u8]>>,
}

/// The mark that some editors write at the beginning of a text in UTF-8. glTF forbids it.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

impl<'a> Document<'a> {
    /// Parses `bytes`, which are the content of the file at `path` and are already taken from the
    /// budget.
    pub(super) fn parse(
        path: &'a Path,
        bytes: &'a [u8],
        budget: Budget<'a>,
    ) -> Result<Self, SceneError> {
        let fail = |place: &str, problem: String| SceneError::Invalid {
            path: path.into(),
            place: place.into(),
            problem,
        };
        let (json, blob) = match bytes.strip_prefix(b"glTF") {
            None => {
                let json = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
                if !json.trim_ascii_start().starts_with(b"{") {
                    return Err(fail("header", "is neither binary glTF 2.0 nor JSON".into()));
                }
                (Cow::Borrowed(bytes), None)
            }
            Some(rest) => {
                // The length field of the header is checked here, because the crate trusts it to be
                // at least the header's own length.
                let length = rest.get(4..8).map(|b| u32::from_le_bytes(b.try_into().unwrap()));
                match length {
                    None => return Err(fail("header", "the file ends within it".into())),
                    Some(n) if n < 20 || n as usize > bytes.len() => {
                        let has = bytes.len();
                        return Err(fail(
                            "header",
                            format!("says that the file has {n} bytes, it has {has}"),
                        ));
                    }
                    Some(_) => {}
                }
                let glb = gltf::Glb::from_slice(bytes)
                    .map_err(|e| fail("chunks", format!("not binary glTF 2.0: {e}")))?;
                (glb.json, glb.bin)
            }
        };
        let marked = json.strip_prefix(BYTE_ORDER_MARK);
        let has_byte_order_mark = marked.is_some();
        let json = marked.unwrap_or(&json);
        // Objects as short as `{}` take a hundred times their length when they are parsed. Nodes
        // are the largest kind.
        let objects = json.iter().filter(|&&b| b == b'{').count() as u64;
        budget.take("JSON", objects, "objects", size_of::<Node>())?;
        budget.take("JSON", json.len() as u64, "characters", 1)?;
        let root: Root = match deserialize::from_slice(json) {
            Err(_) if has_pointers(json) => {
                let taken = budget.taken();
                budget.take("JSON", json.len() as u64, "characters", size_of::<Value>())?;
                let root = without_pointers(json);
                budget.give_back_to(taken);
                root
            }
            root => root,
        }
        .map_err(|e| fail("JSON", format!("is not glTF 2.0: {e}")))?;
        let buffers = Vec::new();
        let mut document = Self { path, root, budget, has_byte_order_mark, buffers };
        document.check_asset()?;
        document.buffers = document.load_buffers(blob)?;
        Ok(document)
    }

    fn check_asset(&self) -> Result<(), SceneError> {
        let asset = &self.root.asset;
        let needs = asset.min_version.as_ref().unwrap_or(&asset.version);
        if !(needs == "2" || needs.starts_with("2.")) {
            let problem = format!("is {needs:?}, only glTF 2 can be read");
            return Err(self.invalid("asset.version", problem));
        }
        match self.root.extensions_required.iter().find(|e| !extensions::can_load(e)) {
            Some(e) => Err(self.invalid(
                "extensionsRequired",
                format!("{e} is not supported: export the file without it"),
            )),
            None => Ok(()),
        }
    }

    fn load_buffers(
        &self,
        mut blob: Option<Cow<'a, [u8]>>,
    ) -> Result<Vec<Cow<'a, [u8]>>, SceneError> {
        let mut buffers = Vec::with_capacity(self.root.buffers.len());
        for (i, buffer) in self.root.buffers.iter().enumerate() {
            let place = format!("buffers[{i}]");
            let bytes = match &buffer.uri {
                Some(uri) => Cow::Owned(self.fetch(uri, &place)?),
                None => blob.take().ok_or_else(|| {
                    self.invalid(&place, "has no uri, and there is no binary chunk for it")
                })?,
            };
            let (needs, has) = (buffer.byte_length.0, bytes.len() as u64);
            if has < needs {
                let problem = format!("is cut off: it should have {needs} bytes, it has {has}");
                return Err(self.invalid(&place, problem));
            }
            buffers.push(bytes);
        }
        Ok(buffers)
    }

    /// The files that this file refers to, without those that do not exist.
    pub(super) fn referred_files(&self) -> Vec<PathBuf> {
        let buffers = self.root.buffers.iter().filter_map(|b| b.uri.as_ref());
        let images = self.root.images.iter().filter_map(|i| i.uri.as_ref());
        let uris = buffers.chain(images).filter(|uri| !uri.starts_with("data:"));
        uris.filter_map(|uri| uri::file_below(self.folder(), uri).ok()).collect()
    }

    fn folder(&self) -> &'a Path {
        self.path.parent().filter(|p| *p != Path::new("")).unwrap_or(Path::new("."))
    }

    /// The bytes that a URI in the file refers to.
    pub(super) fn fetch(&self, uri: &str, place: &str) -> Result<Vec<u8>, SceneError> {
        if let Some(data) = uri.strip_prefix("data:") {
            // Base64 has four characters for three bytes.
            self.budget.take(place, data.len() as u64 / 4 * 3, "bytes of data", 1)?;
            return uri::decode_data(data).map_err(|problem| self.invalid(place, problem));
        }
        let file =
            uri::file_below(self.folder(), uri).map_err(|problem| self.invalid(place, problem))?;
        read_file(&file, &self.budget, place)
    }

    /// The bytes of a buffer view.
    pub(super) fn view(
        &self,
        index: Index<gltf::json::buffer::View>,
        place: &str,
    ) -> Result<&[u8], SceneError> {
        let view = self.get(index, place)?;
        let buffer = self.buffers.get(view.buffer.value()).ok_or_else(|| {
            self.invalid(place, format!("there is no buffers[{}]", view.buffer.value()))
        })?;
        let start = view.byte_offset.map_or(0, |o| o.0);
        let range = usize::try_from(start)
            .ok()
            .zip(start.checked_add(view.byte_length.0).and_then(|end| usize::try_from(end).ok()));
        range.and_then(|(start, end)| buffer.get(start..end)).ok_or_else(|| {
            self.invalid(
                &format!("bufferViews[{}]", index.value()),
                format!(
                    "{} bytes from {start} on do not fit into the buffer's {}",
                    view.byte_length.0,
                    buffer.len()
                ),
            )
        })
    }

    /// The object that an index found at `place` refers to.
    pub(super) fn get<T>(&self, index: Index<T>, place: &str) -> Result<&T, SceneError>
    where
        T: Listed,
        Root: Get<T>,
    {
        let found = Get::<T>::get(&self.root, index);
        found.ok_or_else(|| {
            self.invalid(place, format!("there is no {}[{}]", T::LIST, index.value()))
        })
    }

    pub(super) fn invalid(&self, place: &str, problem: impl Into<String>) -> SceneError {
        SceneError::Invalid { path: self.path.into(), place: place.into(), problem: problem.into() }
    }
}

/// Objects of glTF that are listed at the top of the file.
pub(super) trait Listed {
    /// The list's name.
    const LIST: &'static str;
}

macro_rules! listed {
    ($($object:ty: $list:literal),+ $(,)?) => {
        $(impl Listed for $object {
            const LIST: &'static str = $list;
        })+
    };
}

listed!(
    gltf::json::Accessor: "accessors",
    gltf::json::buffer::View: "bufferViews",
    gltf::json::Camera: "cameras",
    gltf::json::Image: "images",
    gltf::json::Material: "materials",
    gltf::json::Mesh: "meshes",
    gltf::json::Scene: "scenes",
    gltf::json::Skin: "skins",
    gltf::json::Texture: "textures",
    gltf::json::texture::Sampler: "samplers",
);

/// Whether a file may have animations that change other things than nodes. Their channels have no
/// node, which the schema's types refuse.
fn has_pointers(json: &[u8]) -> bool {
    let name = b"KHR_animation_pointer";
    json.windows(name.len()).any(|found| found == name)
}

/// Parses JSON without the channels of animations that have no node.
fn without_pointers(json: &[u8]) -> Result<Root, gltf::json::Error> {
    let mut root: Value = deserialize::from_slice(json)?;
    let animations = root.get_mut("animations").and_then(Value::as_array_mut);
    for animation in animations.into_iter().flatten() {
        if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
            channels.retain(|channel| channel["target"].get("node").is_some());
        }
    }
    deserialize::from_value(root)
}

/// The content of a regular file, for what is at `place` in the scene file.
pub(super) fn read_file(
    path: &Path,
    budget: &Budget<'_>,
    place: &str,
) -> Result<Vec<u8>, SceneError> {
    let fail = |problem| SceneError::Read { path: path.into(), problem };
    let check = |metadata: Metadata| match metadata.is_file() {
        true => Ok(metadata.len()),
        false => Err(fail(std::io::Error::other("is not a regular file"))),
    };
    // This comes before the file is opened, because opening a pipe waits for a writer.
    check(std::fs::metadata(path).map_err(fail)?)?;
    let file = std::fs::File::open(path).map_err(fail)?;
    let length = check(file.metadata().map_err(fail)?)?;
    budget.take(place, length, "bytes of data", 1)?;
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    // Reading ends at the length found above, even if the file grows meanwhile or reports a wrong
    // length.
    file.take(length).read_to_end(&mut bytes).map_err(fail)?;
    Ok(bytes)
}

/// Notices about repairs. Repairs of one kind are collected into one sentence.
#[derive(Default)]
pub(super) struct Notices {
    entries: Vec<Entry>,
}

struct Entry {
    what: String,
    first: String,
    /// Why it was at the first place; empty if that is always the same.
    why: String,
    places: usize,
    items: usize,
}

impl Notices {
    /// Notes a repair of one thing at `place`.
    pub(super) fn add(&mut self, place: impl Display, what: impl Into<String>) {
        self.count(place, 0, what, "");
    }

    /// Notes a repair of one thing at `place`, whose reason differs from place to place. That of
    /// the first place is told.
    pub(super) fn add_because(&mut self, place: impl Display, what: &str, why: &str) {
        self.count(place, 0, what, why);
    }

    /// Notes a repair of `items` things at `place`; notes nothing if `items` is 0.
    pub(super) fn add_some(&mut self, place: impl Display, items: usize, what: &str) {
        if items > 0 {
            self.count(place, items, what, "");
        }
    }

    fn count(&mut self, place: impl Display, items: usize, what: impl Into<String>, why: &str) {
        let what = what.into();
        match self.entries.iter_mut().find(|e| e.what == what) {
            Some(e) => {
                e.places += 1;
                e.items += items;
            }
            None => {
                let first = place.to_string();
                self.entries.push(Entry { what, first, why: why.into(), places: 1, items });
            }
        }
    }

    pub(super) fn finish(self) -> Vec<Notice> {
        let sentence = |e: Entry| {
            let others = match e.places {
                1 => String::new(),
                n => format!(" and {} more", n - 1),
            };
            let items = if e.items > 0 { format!("{} ", e.items) } else { String::new() };
            let why = if e.why.is_empty() { String::new() } else { format!(": {}", e.why) };
            Notice(format!("{}{others}: {items}{}{why}", e.first, e.what))
        };
        self.entries.into_iter().map(sentence).collect()
    }
}
