use base64::Engine;
use std::path::{Component, Path, PathBuf};

/// The bytes of a data URI, given the text that follows `data:`. Only base64 is accepted, as glTF
/// demands.
pub(super) fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (head, payload) = data.split_once(',').ok_or("its data: URI has no comma")?;
    if !head.ends_with(";base64") {
        return Err("its data: URI is not base64".into());
    }
    base64::engine::general_purpose::STANDARD
        .decode(payload.trim_end())
        .map_err(|e| format!("its data: URI is broken: {e}"))
}

/// The path that a relative, percent-encoded URI refers to, if it is a regular file below `folder`.
pub(super) fn file_below(folder: &Path, uri: &str) -> Result<PathBuf, String> {
    let refuse =
        |why: &str| Err(format!("uri {uri:?} {why}; only files below the scene's folder are read"));
    let Ok(relative) = percent_encoding::percent_decode_str(uri).decode_utf8() else {
        return refuse("is not UTF-8");
    };
    if relative.split(['/', '\\']).next().is_some_and(|first| first.contains(':')) {
        return refuse("has a scheme or a drive");
    }
    let relative = Path::new(&*relative);
    for component in relative.components() {
        match component {
            Component::Normal(_) | Component::CurDir => {}
            Component::ParentDir => return refuse("leads out of the folder by .."),
            Component::RootDir | Component::Prefix(_) => return refuse("is absolute"),
        }
    }
    // The path is resolved on disk, so that no link leads out of the folder.
    let real = |p: &Path| p.canonicalize().map_err(|e| format!("uri {uri:?}: {e}"));
    let file = real(&folder.join(relative))?;
    if !file.starts_with(real(folder)?) {
        return refuse("leads out of the folder by a link");
    }
    // Pipes and devices have no end, or make whoever opens them wait.
    if !file.is_file() {
        return refuse("is not a regular file");
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_decode_or_say_why_not() {
        let good = "application/octet-stream;base64,AAEC/w==";
        assert_eq!(decode_data(good), Ok(vec![0, 1, 2, 255]));
        for bad in ["", "text/plain,hello", ";base64", ";base64,*", "application/x;base64,AAE"] {
            assert!(decode_data(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn only_files_below_the_folder_are_found() {
        let outside = tempfile::tempdir().unwrap();
        let folder = outside.path().join("scene");
        std::fs::create_dir_all(folder.join("a b")).unwrap();
        std::fs::write(outside.path().join("secret"), "x").unwrap();
        std::fs::write(folder.join("a b/ü.bin"), "x").unwrap();
        for good in ["a%20b/%C3%BC.bin", "a b/ü.bin", "./a%20b/%c3%bc.bin"] {
            assert!(file_below(&folder, good).is_ok(), "{good}");
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(outside.path(), folder.join("link")).unwrap();
        let absolute = outside.path().join("secret");
        for bad in [
            "../secret",
            "a%20b/../../secret",
            "%2e%2e/secret",
            "..%2Fsecret",
            "link/secret",
            "file:///etc/passwd",
            "http://example.org/x.bin",
            "C:/x.bin",
            "missing.bin",
            "%FF",
            "a%00b",
            "a%20b",
            absolute.to_str().unwrap(),
        ] {
            assert!(file_below(&folder, bad).is_err(), "{bad}");
        }
    }
}
