//! What a process has read is not written over. In a process of its own: the protection is for all of it.
#![allow(clippy::disallowed_methods)]

use yugen_archive::{
    atomic_write, check_outputs, check_writable, protect_inputs, read_bounded, read_own, update,
};

#[test]
fn inputs_are_known_by_what_they_are() {
    let folder = std::env::temp_dir().join(format!("yugen-inputs-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("deep")).unwrap();
    let at = |name: &str| folder.join(name);
    for name in ["in", "early", "own", "free"] {
        std::fs::write(at(name), name).unwrap();
    }
    read_bounded(&at("early"), 9).unwrap();
    assert!(check_writable(&at("early")).is_ok(), "nobody asked for protection yet");
    protect_inputs();
    read_bounded(&at("in"), 9).unwrap();
    assert_eq!(read_own(&at("own"), 9).unwrap(), b"own");
    std::fs::hard_link(at("in"), at("hard")).unwrap();
    let mut names = vec!["in", "early", "deep/../in", "hard"];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("in", at("soft")).unwrap();
        names.push("soft");
    }
    for name in names {
        for refused in [check_outputs([at(name)]), check_writable(&at(name)), atomic_write(&at(name), b"x")] {
            assert!(refused.unwrap_err().to_string().contains("this is read, and would be lost"), "{name}");
        }
    }
    assert_eq!(std::fs::read(at("in")).unwrap(), b"in");
    for name in ["own", "free", "new", "deep/in"] {
        assert!(check_outputs([at(name)]).is_ok() && check_writable(&at(name)).is_ok(), "{name}");
        atomic_write(&at(name), b"x").unwrap();
    }
    let twice = check_outputs([at("new"), at("deep/../new")]).unwrap_err().to_string();
    assert!(twice.contains("two outputs have this name"), "{twice}");

    // An input that is gone gives its inode away, and whoever has it next is no input; its name still is one.
    std::fs::remove_file(at("hard")).unwrap();
    #[cfg(unix)]
    std::fs::remove_file(at("soft")).unwrap();
    std::fs::remove_file(at("in")).unwrap();
    for i in 0..50 {
        let name = format!("next{i}");
        std::fs::write(at(&name), b"x").unwrap();
        assert!(check_outputs([at(&name)]).is_ok(), "{name}");
    }
    std::fs::write(at("in"), b"edited meanwhile").unwrap();
    assert!(check_outputs([at("in")]).is_err());
    update(&at("in"), b"changed").unwrap();
    assert_eq!(std::fs::read(at("in")).unwrap(), b"changed");
    std::fs::remove_dir_all(&folder).unwrap();
}
