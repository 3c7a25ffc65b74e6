//! A table of hashes beside the one that is committed, which `CLUTCH_BITS=write` writes anew.

pub(crate) fn compare(name: &str, table: &str) {
    let file = format!("{}/tests/{name}.txt", env!("CARGO_MANIFEST_DIR"));
    if std::env::var("CLUTCH_BITS").is_ok_and(|word| word == "write") {
        std::fs::write(file, table).unwrap();
        return;
    }
    let committed = std::fs::read_to_string(file).unwrap();
    for (now, before) in table.lines().zip(committed.lines()) {
        assert_eq!(now, before, "other bits than those that are committed");
    }
    assert_eq!(table.lines().count(), committed.lines().count(), "other rows than those that are committed");
}
