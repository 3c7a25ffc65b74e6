//! Tables as Parquet, which the command writes only where it is built with it: read back by the library's reader.

use clutch_log::{Limits, TIME};
use parquet::basic::Compression;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A new folder of a test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder); // there is none at the first time
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Runs the command; it has to succeed.
fn clutch(args: &[&str]) {
    let done = Command::new(env!("CARGO_BIN_EXE_clutch")).args(args).output().expect("the command runs");
    assert!(done.status.success(), "{args:?}: {}", String::from_utf8_lossy(&done.stderr));
}

/// A value of Parquet as it stands in a CSV.
fn as_csv(value: &Field) -> String {
    match value {
        Field::Double(x) => format!("{x:?}"),
        Field::Long(x) => x.to_string(),
        Field::Bool(x) => u8::from(*x).to_string(),
        Field::Str(x) => x.clone(),
        other => panic!("no column is of this type: {other:?}"),
    }
}

#[test]
fn a_channel_as_parquet_has_the_cells_of_its_csv() {
    let dir = folder("parquet");
    let path = |name: &str| dir.join(name).display().to_string();
    let log = path("run.mcap");
    // More rows than are written at once: two row groups.
    clutch(&["sim", "smc_2", "--set", "run.duration_s=70", "--log", &log]);
    let header = clutch_log::read(&log, &Limits::default()).expect("a log").header;
    for channel in ["sample", "command", "truth"] {
        let (table, lines) = (path(&format!("{channel}.parquet")), path(&format!("{channel}.csv")));
        clutch(&["log", "export", &log, "--channel", channel, "--out", &table]);
        clutch(&["log", "export", &log, "--channel", channel, "--out", &lines]);
        let file = SerializedFileReader::new(File::open(&table).expect("a file")).expect("a table");
        let mut csv = csv::Reader::from_path(&lines).expect("a table");
        let names = csv.headers().expect("names").clone();
        assert_eq!(&names[0], TIME);
        let mut rows = 0;
        for (row, line) in file.get_row_iter(None).expect("rows").zip(csv.records()) {
            let (row, line) = (row.expect("a row"), line.expect("a line"));
            let cells: Vec<_> = row.get_column_iter().collect();
            assert!(cells.iter().map(|(name, _)| name.as_str()).eq(names.iter()));
            for ((name, value), text) in cells.iter().zip(line.iter()) {
                assert_eq!(as_csv(value), text, "{channel}, row {rows}, {name}");
            }
            rows += 1;
        }
        let info = file.metadata();
        assert!(rows == 70_000 && info.file_metadata().num_rows() == rows, "{channel}: {rows} rows");
        assert_eq!(info.num_row_groups(), 2);
        assert!(matches!(info.row_group(0).column(0).compression(), Compression::ZSTD(_)));
        let kept = info.file_metadata().key_value_metadata().expect("the log's description");
        let kept = |key: &str| kept.iter().find(|kv| kv.key == key).and_then(|kv| kv.value.as_deref());
        assert_eq!((kept("channel"), kept("source")), (Some(channel), Some("simulation")));
        assert_eq!(kept("scenario.toml"), Some(header.scenario_toml.as_str()));
    }
}

/// `clutch sweep` of twelve rows, four of which are refused, into a file.
fn sweep(file: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_clutch"));
    command.args(["sweep", "pd_2", "--set", "run.duration_s=1.2", "--over", "law.pd.kp_v_rad=500,-1,2000.5"]);
    command.args(["--over", "run.start=on_path,rest", "--seeds", "2", "--out"]).arg(file).args(more);
    command.output().expect("the command runs")
}

#[test]
fn a_sweep_as_parquet_has_the_cells_of_its_csv_and_goes_on_where_it_was_cut_off() {
    let dir = folder("sweep");
    let (lines, table, cut) = (dir.join("a.csv"), dir.join("a.parquet"), dir.join("cut.parquet"));
    for file in [&lines, &table] {
        let o = sweep(file, &[]);
        assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
        let told = String::from_utf8_lossy(&o.stdout).into_owned();
        assert!(told.starts_with("12 of 12 rows in ") && told.contains(&*file.to_string_lossy()), "{told}");
    }
    let mut csv = csv::Reader::from_path(&lines).expect("a table");
    let file = SerializedFileReader::new(File::open(&table).expect("a file")).expect("a table");
    let (mut rows, mut refused) = (0, 0);
    for (row, line) in file.get_row_iter(None).expect("rows").zip(csv.records()) {
        let (row, line) = (row.expect("a row"), line.expect("a line"));
        for ((name, value), text) in row.get_column_iter().zip(line.iter()) {
            match value {
                // Of a refused row, or of a run that does not tell: no number, and neither certified nor not.
                Field::Null => assert_eq!(text, "", "row {rows}, {name}"),
                Field::Double(x) => {
                    let there: f64 = text.parse().expect("a number");
                    assert_eq!(there.to_bits(), x.to_bits(), "row {rows}, {name}");
                }
                Field::Bool(x) => assert_eq!(x.to_string(), text, "row {rows}, {name}"),
                other => assert_eq!(as_csv(other), text, "row {rows}, {name}"),
            }
        }
        refused += u32::from(!line[line.len() - 1].is_empty());
        rows += 1;
    }
    assert_eq!((rows, refused), (12, 4));

    // A kill leaves the CSV beside it, which goes on to the same file.
    let whole = std::fs::read(&table).expect("a file");
    let text = std::fs::read(&lines).expect("a file");
    let beside = cut.with_extension("parquet.part.csv");
    for length in [text.len() / 2, text.len()] {
        std::fs::write(&beside, &text[..length]).expect("a file");
        std::fs::write(cut.with_extension("parquet.part"), b"PAR1").expect("a file");
        let o = sweep(&cut, &["--resume"]);
        assert!(o.status.success(), "{length} bytes: {}", String::from_utf8_lossy(&o.stderr));
        assert!(std::fs::read(&cut).expect("a file") == whole, "{length} bytes: another file");
        assert!(!beside.exists() && !cut.with_extension("parquet.part").exists());
        std::fs::remove_file(&cut).expect("a file");
    }
    let again = sweep(&table, &["--resume"]);
    let said = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(again.status.code() == Some(1) && said.contains("a.parquet: exists already"), "{said}");
    assert!(std::fs::read(&table).expect("a file") == whole);
}
