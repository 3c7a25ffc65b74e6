//! Answers of this machine, for comparison with those of a browser: a question a line, an answer a line.

use clutch_web::Answerer;

fn main() -> std::io::Result<()> {
    let mut answerer = Answerer::new();
    for question in std::io::stdin().lines() {
        println!("{}", answerer.answer(&question?));
    }
    Ok(())
}
