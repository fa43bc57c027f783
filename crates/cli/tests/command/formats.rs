//! The page of what is read of the formats of others.

use std::fmt::Write;
use std::path::PathBuf;
use yugen_archive::formats::support::{Feature, Support};
use yugen_archive::formats::{FORMATS, MESH_FORMATS, features, image, measured, motion};

fn extensions(all: &[&str]) -> String {
    all.iter().map(|e| format!("`.{e}`")).collect::<Vec<_>>().join(", ")
}

fn support(s: Support) -> [&'static str; 2] {
    match s {
        Support::Yes => ["yes", ""],
        Support::Partly(left_out) => ["partly", left_out],
        Support::No(why) => ["no", why],
    }
}

fn page() -> String {
    let mut out = String::from(
        "# What is read\n\nMade from the tables that the readers themselves use (`cargo test -p yugen-cli --test command`). What \
         is not read is skipped with a warning that gives the reason, or refused where the picture would be wrong \
         without it.\n\n## Scenes\n\n| format | files |\n| --- | --- |\n",
    );
    for f in FORMATS {
        writeln!(out, "| {} | {} |", f.name, extensions(f.extensions)).unwrap();
    }
    out.push_str("\n## Meshes\n\nA `[[shape]]` of `type = \"file\"` takes these and glTF.\n\n| format | files |\n| --- | --- |\n");
    for (name, files) in MESH_FORMATS {
        writeln!(out, "| {name} | {} |", extensions(files)).unwrap();
    }
    out.push_str("\n## Pictures\n\n| format | files | read | what is left out | written |\n| --- | --- | --- | --- | --- |\n");
    for f in image::formats() {
        let [read, left_out] = support(f.support);
        let written = if f.written { "yes" } else { "no" };
        writeln!(out, "| {} | {} | {read} | {left_out} | {written} |", f.name, extensions(f.extensions))
            .unwrap();
    }
    out.push_str(
        "\n## Measured reflectance\n\nFor `yugen brdf` and, as `data`, for the materials of scenes. Files that share an extension are told apart by \
         what is in them.\n\n| format | files | model | written |\n| --- | --- | --- | --- |\n",
    );
    for (name, files, model, written) in measured::formats() {
        let written = if written { "yes" } else { "no" };
        writeln!(out, "| {name} | {} | `{model}` | {written} |", extensions(files)).unwrap();
    }
    out.push_str("\n## Motion\n\nFor `yugen motion`, and shown as sticks by `yugen render` and `yugen view`. Tables are told apart by how they begin.\n\n| format | files |\n| --- | --- |\n");
    for f in motion::FORMATS {
        writeln!(out, "| {} | {} |", f.name, extensions(f.extensions)).unwrap();
    }
    out.push_str("\n| written | file | how |\n| --- | --- | --- |\n");
    for w in motion::WRITTEN {
        writeln!(out, "| {} | {} | {} |", w.name, extensions(&[w.extension]), w.doc).unwrap();
    }
    for (title, table) in features() {
        assert!(!table.is_empty(), "{title}");
        write!(out, "\n## {title}\n\n| | read | what is left out, or why |\n| --- | --- | --- |\n").unwrap();
        for Feature { name, support: s } in table {
            let [read, left_out] = support(s);
            let row = [name, read, left_out].map(|cell| cell.replace('|', "\\|"));
            writeln!(out, "| {} | {} | {} |", row[0], row[1], row[2]).unwrap();
        }
    }
    out
}

/// The page is what the tables say; `BLESS=1` writes it anew.
#[test]
fn the_page_of_formats_is_up_to_date() {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let page = page();
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&file, &page).unwrap();
    }
    let written = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(written == page, "docs/formats.md is not what the tables say; BLESS=1 writes it anew");
}

/// A name said twice would be looked up as the first, and a gap left unexplained helps nobody.
#[test]
fn tables_name_each_feature_once_and_give_reasons() {
    for (title, table) in features() {
        for (i, f) in table.iter().enumerate() {
            assert!(table[..i].iter().all(|g| g.name != f.name), "{title}: {} twice", f.name);
            let [read, left_out] = support(f.support);
            assert_eq!(read == "yes", left_out.is_empty(), "{title}: {}", f.name);
        }
    }
}
