//! Files that follow from the declarations and are kept in the tree are what they give.

#[allow(dead_code, reason = "an example's `main`; here only its comparison is called")]
#[path = "../examples/generate/main.rs"]
mod generate;

#[test]
fn generated_files_are_what_the_declarations_give() {
    let stale: Vec<_> = generate::stale().unwrap().into_iter().map(|(name, _)| name).collect();
    assert!(stale.is_empty(), "{stale:?}: run `cargo xtask generate`");
}
