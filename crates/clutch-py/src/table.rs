//! Named columns of equal length, which results, logs and sweeps give to Python.
//!
//! A column's numbers stay where the simulation wrote them; NumPy and Arrow read that memory.

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{
    ArrayRef, ArrowPrimitiveType, BooleanArray, PrimitiveArray, RecordBatch, RecordBatchIterator,
    RecordBatchOptions, StringArray, types,
};
use arrow_buffer::{Buffer, ScalarBuffer};
use arrow_schema::{ArrowError, Field, Schema};
use numpy::ndarray::ArrayView1;
use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyList, PyMapping, PyString};
use std::collections::HashMap;
use std::panic::{RefUnwindSafe, UnwindSafe};
use std::ptr::NonNull;
use std::sync::Arc;

/// Owner of a column's memory.
pub(crate) type Owner = Arc<dyn OwnerOfMemory>;
/// A possible owner.
pub(crate) trait OwnerOfMemory: Send + Sync + RefUnwindSafe + UnwindSafe {}
impl<T: Send + Sync + RefUnwindSafe + UnwindSafe> OwnerOfMemory for T {}

/// A slice that keeps its owner alive.
#[derive(Clone)]
pub(crate) struct Shared<T> {
    owner: Owner,
    first: NonNull<T>,
    len: usize,
}

// SAFETY: the memory is only read, for as long as the owner, which is Send and Sync, lives.
unsafe impl<T: Sync> Send for Shared<T> {}
// SAFETY: as above.
unsafe impl<T: Sync> Sync for Shared<T> {}

impl<T> Shared<T> {
    /// The part of `owner` that `slice` picks.
    fn of<O: OwnerOfMemory + 'static>(owner: &Arc<O>, slice: impl FnOnce(&O) -> &[T]) -> Self {
        let slice = slice(owner);
        // A shared owner never changes, so that the slice stays where it is.
        Shared { first: NonNull::from(slice).cast(), len: slice.len(), owner: owner.clone() }
    }

    fn slice(&self) -> &[T] {
        // SAFETY: `of` took pointer and length from a slice of the owner, which lives.
        unsafe { std::slice::from_raw_parts(self.first.as_ptr(), self.len) }
    }
}

/// A column of one type.
#[derive(Clone)]
pub(crate) enum Column {
    F64(Shared<f64>),
    I64(Shared<i64>),
    I32(Shared<i32>),
    U16(Shared<u16>),
    Bool(Shared<bool>),
    Text(Arc<Vec<String>>),
}

/// Types that columns have.
pub(crate) trait InColumn: Sized + 'static {
    fn column(slice: Shared<Self>) -> Column;
}

macro_rules! in_column {
    ($($t:ty => $variant:ident),*) => { $(impl InColumn for $t {
        fn column(slice: Shared<Self>) -> Column { Column::$variant(slice) }
    })* };
}
in_column!(f64 => F64, i64 => I64, i32 => I32, u16 => U16, bool => Bool);

impl Column {
    /// A column that is part of something larger, which is kept alive.
    pub(crate) fn part<O: OwnerOfMemory + 'static, T: InColumn>(
        owner: &Arc<O>,
        slice: impl FnOnce(&O) -> &[T],
    ) -> Column {
        T::column(Shared::of(owner, slice))
    }

    /// A column of its own.
    pub(crate) fn own<T: InColumn + Send + Sync + RefUnwindSafe + UnwindSafe>(values: Vec<T>) -> Column {
        Column::part(&Arc::new(values), |v: &Vec<T>| v.as_slice())
    }

    /// A column of texts.
    pub(crate) fn text(values: impl IntoIterator<Item = impl Into<String>>) -> Column {
        Column::Text(Arc::new(values.into_iter().map(Into::into).collect()))
    }

    /// Each `n`th value.
    pub(crate) fn every(&self, n: usize) -> Column {
        fn pick<T: Copy>(c: &Shared<T>, n: usize) -> Vec<T> {
            c.slice().iter().step_by(n).copied().collect()
        }
        match self {
            Column::F64(c) => Column::own(pick(c, n)),
            Column::I64(c) => Column::own(pick(c, n)),
            Column::I32(c) => Column::own(pick(c, n)),
            Column::U16(c) => Column::own(pick(c, n)),
            Column::Bool(c) => Column::own(pick(c, n)),
            Column::Text(c) => Column::text(c.iter().step_by(n).cloned()),
        }
    }

    fn len(&self) -> usize {
        match self {
            Column::F64(c) => c.len,
            Column::I64(c) => c.len,
            Column::I32(c) => c.len,
            Column::U16(c) => c.len,
            Column::Bool(c) => c.len,
            Column::Text(c) => c.len(),
        }
    }

    /// As NumPy's array (texts: a list), without copying; `keeper` holds the column.
    fn to_python<'py>(&self, py: Python<'py>, keeper: &Bound<'py, Table>) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Column::F64(c) => view(c, keeper),
            Column::I64(c) => view(c, keeper),
            Column::I32(c) => view(c, keeper),
            Column::U16(c) => view(c, keeper),
            Column::Bool(c) => view(c, keeper),
            Column::Text(c) => Ok(PyList::new(py, c.iter())?.into_any()),
        }
    }

    fn to_arrow(&self) -> ArrayRef {
        match self {
            Column::F64(c) => primitive::<types::Float64Type>(c),
            Column::I64(c) => primitive::<types::Int64Type>(c),
            Column::I32(c) => primitive::<types::Int32Type>(c),
            Column::U16(c) => primitive::<types::UInt16Type>(c),
            // Arrow packs eight booleans into a byte.
            Column::Bool(c) => Arc::new(BooleanArray::from(c.slice().to_vec())),
            Column::Text(c) => Arc::new(StringArray::from_iter_values(c.iter())),
        }
    }

    /// Reads any array that NumPy can make.
    fn read(values: &Bound<'_, PyAny>, name: &str) -> PyResult<Column> {
        let py = values.py();
        let numpy = py.import("numpy")?;
        if !values.is_instance_of::<PyString>()
            && values.len().is_ok_and(|n| n > 0)
            && let Ok(texts) = values.extract::<Vec<String>>()
        {
            return Ok(Column::text(texts));
        }
        let bad = |what: &str| Err(PyValueError::new_err(format!("column \"{name}\" {what}")));
        if numpy.getattr("ma")?.call_method1("isMaskedArray", (values,))?.is_truthy()? {
            return bad("has a mask: expected an array without missing values");
        }
        let array = numpy.call_method1("asarray", (values,))?;
        if array.getattr("ndim")?.extract::<usize>()? != 1 {
            let shape = array.getattr("shape")?;
            return bad(&format!("has the shape {shape}: expected one dimension"));
        }
        let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
        let dtype: String = array.getattr("dtype")?.getattr("name")?.extract()?;
        let plain = |dtype: &str| numpy.call_method1("require", (&array, dtype, "CA"));
        Ok(match kind.as_str() {
            "f" => {
                Column::own(plain("float64")?.extract::<PyReadonlyArray1<'_, f64>>()?.as_slice()?.to_vec())
            }
            // As they were in the table that this one is a copy of.
            "i" | "u" if dtype == "int32" => {
                Column::own(plain("int32")?.extract::<PyReadonlyArray1<'_, i32>>()?.as_slice()?.to_vec())
            }
            "i" | "u" if dtype == "uint16" => {
                Column::own(plain("uint16")?.extract::<PyReadonlyArray1<'_, u16>>()?.as_slice()?.to_vec())
            }
            "u" if dtype == "uint64"
                && array.call_method1("__gt__", (i64::MAX,))?.call_method0("any")?.is_truthy()? =>
            {
                return bad("has numbers above 2^63 − 1");
            }
            "i" | "u" => {
                Column::own(plain("int64")?.extract::<PyReadonlyArray1<'_, i64>>()?.as_slice()?.to_vec())
            }
            "b" => Column::own(plain("bool")?.extract::<PyReadonlyArray1<'_, bool>>()?.as_slice()?.to_vec()),
            // NumPy turns every element of a mixed list into a string.
            "U" | "O" | "T" if values.hasattr("dtype")? => {
                match array.call_method0("tolist")?.extract::<Vec<String>>() {
                    Ok(texts) => Column::text(texts),
                    Err(_) => return bad("mixes texts with other values"),
                }
            }
            "U" | "O" | "T" => return bad("mixes texts with other values"),
            _ => return bad(&format!("has the dtype {dtype}: expected numbers, bool or str")),
        })
    }

    fn same(&self, other: &Column) -> bool {
        // Bit for bit: a NaN equals itself, and 0.0 is not −0.0.
        let bits = |a: &f64, b: &f64| a.to_bits() == b.to_bits();
        match (self, other) {
            (Column::F64(a), Column::F64(b)) => {
                a.len == b.len && a.slice().iter().zip(b.slice()).all(|(a, b)| bits(a, b))
            }
            (Column::I64(a), Column::I64(b)) => a.slice() == b.slice(),
            (Column::I32(a), Column::I32(b)) => a.slice() == b.slice(),
            (Column::U16(a), Column::U16(b)) => a.slice() == b.slice(),
            (Column::Bool(a), Column::Bool(b)) => a.slice() == b.slice(),
            (Column::Text(a), Column::Text(b)) => a == b,
            _ => false,
        }
    }
}

fn view<'py, T: Element>(c: &Shared<T>, keeper: &Bound<'py, Table>) -> PyResult<Bound<'py, PyAny>> {
    let numbers = ArrayView1::from(c.slice());
    // SAFETY: the table, which NumPy keeps alive, holds the column and never changes.
    let array = unsafe { PyArray1::borrow_from_array(&numbers, keeper.clone().into_any()) };
    // Written to, it would change the run that it belongs to.
    array.try_readwrite()?.make_nonwriteable();
    Ok(array.into_any())
}

fn primitive<P: ArrowPrimitiveType>(c: &Shared<P::Native>) -> ArrayRef {
    let bytes = size_of_val(c.slice());
    let owner: Arc<dyn arrow_buffer::alloc::Allocation> = Arc::new(Kept(c.owner.clone()));
    // SAFETY: the owner keeps that many bytes alive and unchanged.
    let buffer = unsafe { Buffer::from_custom_allocation(c.first.cast(), bytes, owner) };
    Arc::new(PrimitiveArray::<P>::new(ScalarBuffer::new(buffer, 0, c.len), None))
}

/// The owner that Arrow holds for as long as it reads a column; never read.
struct Kept(#[allow(dead_code)] Owner);

/// Named columns of equal length.
///
/// Results, logs and sweeps are tables. Any library that reads Arrow streams takes one directly
/// (`pyarrow.table(t)`, `polars.DataFrame(t)`, `pandas.DataFrame.from_arrow(t)`), numbers without
/// copying.
///
/// Parameters
/// ----------
/// columns : dict
///     Name to one-dimensional array of numbers, bools or texts, all of one length.
/// meanings : dict, optional
///     Name of a column to its meaning in a few words, which xarray and Arrow get as `long_name`.
///
/// Raises
/// ------
/// ValueError
///     Columns of unequal length, of more than one dimension, or of another type; the meaning of none.
///
/// Examples
/// --------
/// >>> import clutch
/// >>> t = clutch.Table({"time_s": [0.0, 0.001], "counts": [0, 3]})
/// >>> t
/// Table(2 rows: time_s, counts)
/// >>> int(t["counts"].sum())
/// 3
/// >>> t.to_pandas()["time_s"].tolist()
/// [0.0, 0.001]
#[pyclass(frozen, module = "clutch", eq)]
pub(crate) struct Table {
    names: Vec<String>,
    columns: Vec<Column>,
    /// The meaning of each column, in a few words; empty where nothing is known.
    meanings: Vec<String>,
    rows: usize,
}

impl PartialEq for Table {
    fn eq(&self, other: &Self) -> bool {
        self.names == other.names && self.columns.iter().zip(&other.columns).all(|(a, b)| a.same(b))
    }
}

impl Table {
    /// A table of columns that are known to be of one length.
    pub(crate) fn of(columns: impl IntoIterator<Item = (impl Into<String>, Column)>) -> Table {
        let (names, columns): (Vec<_>, Vec<_>) = columns.into_iter().map(|(n, c)| (n.into(), c)).unzip();
        let rows = columns.first().map_or(0, Column::len);
        debug_assert!(columns.iter().all(|c| c.len() == rows));
        Table { meanings: vec![String::new(); names.len()], names, columns, rows }
    }

    /// The same with the meanings of those columns that have these names.
    pub(crate) fn meaning<'a>(mut self, meanings: impl IntoIterator<Item = (&'a str, &'a str)>) -> Table {
        for (name, meaning) in meanings {
            if let Some(i) = self.names.iter().position(|n| n == name) {
                self.meanings[i] = meaning.to_owned();
            }
        }
        self
    }

    /// The number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// `attributes` gives what is kept beside each column: its unit, if it has one.
    fn batch(&self, attributes: Vec<HashMap<String, String>>) -> Result<RecordBatch, ArrowError> {
        let arrays: Vec<ArrayRef> = self.columns.iter().map(Column::to_arrow).collect();
        let columns = self.names.iter().zip(&arrays).zip(attributes);
        let fields: Vec<Field> = columns
            .map(|((name, a), attributes)| {
                Field::new(name, a.data_type().clone(), false).with_metadata(attributes)
            })
            .collect();
        // The number of rows for a table without columns, which is one, too.
        let options = RecordBatchOptions::new().with_row_count(Some(self.rows));
        RecordBatch::try_new_with_options(Arc::new(Schema::new(fields)), arrays, &options)
    }
}

fn made_elsewhere<'py>(
    slf: &Bound<'py, Table>,
    how: &str,
    index: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let module = slf.py().import("clutch._convert")?;
    match how {
        "to_xarray" => module.call_method1(how, (slf, index)),
        _ => module.call_method1(how, (slf,)),
    }
}

#[pymethods]
impl Table {
    #[new]
    #[pyo3(signature = (columns, meanings=None))]
    fn new(columns: &Bound<'_, PyMapping>, meanings: Option<HashMap<String, String>>) -> PyResult<Table> {
        let mut read = Vec::new();
        for item in columns.items()? {
            let (name, values): (String, Bound<'_, PyAny>) = item.extract()?;
            let column = Column::read(&values, &name)?;
            read.push((name, column));
        }
        if let Some((first, rest)) = read.split_first()
            && let Some(other) = rest.iter().find(|(_, c)| c.len() != first.1.len())
        {
            return Err(PyValueError::new_err(format!(
                "column \"{}\" has {} rows: expected {}, as many as column \"{}\"",
                other.0,
                other.1.len(),
                first.1.len(),
                first.0
            )));
        }
        let meanings = meanings.unwrap_or_default();
        let table = Table::of(read);
        if let Some(name) = meanings.keys().find(|name| !table.names.contains(name)) {
            let columns = table.names.join(", ");
            return Err(PyValueError::new_err(format!(
                "meanings: {name}: expected one of the columns {columns}"
            )));
        }
        Ok(table.meaning(meanings.iter().map(|(name, meaning)| (name.as_str(), meaning.as_str()))))
    }

    /// Unit and meaning of a column, as xarray's attributes and Arrow's metadata have them: `units`, `long_name`; those
    /// that are known.
    fn attributes<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
        let Some(i) = self.names.iter().position(|n| n == name) else {
            let text = format!("{name}: expected one of the columns {}", self.names.join(", "));
            return Err(PyKeyError::new_err(text));
        };
        let known = py.import("clutch._units")?.call_method1("attributes", (name,))?;
        let known = known.cast_into::<PyDict>()?;
        if !self.meanings[i].is_empty() {
            known.set_item("long_name", &self.meanings[i])?;
        }
        Ok(known)
    }

    /// Names of the columns, in order.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.names.clone()
    }

    fn __len__(&self) -> usize {
        self.rows
    }

    fn __contains__(&self, name: &Bound<'_, PyAny>) -> bool {
        name.extract::<&str>().is_ok_and(|name| self.names.iter().any(|n| n == name))
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        PyList::new(py, &self.names)?.call_method0("__iter__")
    }

    /// A column: NumPy's array, read-only and not copied; texts as a list.
    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let table = slf.get();
        let Some(i) = table.names.iter().position(|n| n == name) else {
            let text = format!("{name}: expected one of the columns {}", table.names.join(", "));
            return Err(PyKeyError::new_err(text));
        };
        table.columns[i].to_python(slf.py(), slf)
    }

    /// Columns by name, in a dict.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(slf.py());
        for (name, column) in slf.get().names.iter().zip(&slf.get().columns) {
            dict.set_item(name, column.to_python(slf.py(), slf)?)?;
        }
        Ok(dict)
    }

    /// As a `pandas.DataFrame`, numbers without copying.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        made_elsewhere(slf, "to_pandas", None)
    }

    /// As a `polars.DataFrame`, numbers without copying.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        made_elsewhere(slf, "to_polars", None)
    }

    /// As a `pyarrow.Table`, numbers without copying.
    fn to_arrow<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        made_elsewhere(slf, "to_arrow", None)
    }

    /// As an `xarray.Dataset` with one dimension; `index` is the column that becomes its
    /// coordinate.
    #[pyo3(signature = (index=None))]
    fn to_xarray<'py>(slf: &Bound<'py, Self>, index: Option<&str>) -> PyResult<Bound<'py, PyAny>> {
        made_elsewhere(slf, "to_xarray", index)
    }

    /// The table as an Arrow C stream, which other libraries read.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema; // a hint, which a producer may ignore
        let wrong = |e: ArrowError| PyValueError::new_err(e.to_string());
        let of = |name: &String| self.attributes(py, name)?.extract();
        let attributes = self.names.iter().map(of).collect::<PyResult<_>>()?;
        let batch = self.batch(attributes).map_err(wrong)?;
        let schema = batch.schema();
        let reader = RecordBatchIterator::new([Ok(batch)], schema);
        let stream = FFI_ArrowArrayStream::new(Box::new(reader));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }

    #[allow(clippy::type_complexity, reason = "pickle's form")]
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyDict>, HashMap<String, String>))> {
        let dict = Table::to_dict(slf)?;
        for (name, column) in slf.get().names.iter().zip(&slf.get().columns) {
            if let Column::Text(texts) = column {
                // A list without texts would come back as numbers.
                let numpy = slf.py().import("numpy")?;
                let array = numpy.call_method1("array", (PyList::new(slf.py(), texts.iter())?, "object"))?;
                dict.set_item(name, array)?;
            }
        }
        let table = slf.get();
        let meanings = table.names.iter().cloned().zip(table.meanings.iter().cloned());
        let meanings = meanings.filter(|(_, meaning)| !meaning.is_empty()).collect();
        Ok((slf.get_type().into_any(), (dict, meanings)))
    }

    fn __repr__(&self) -> String {
        format!("Table({} rows: {})", self.rows, self.names.join(", "))
    }

    fn _repr_html_(slf: &Bound<'_, Self>) -> PyResult<String> {
        slf.py().import("clutch._convert")?.call_method1("table_html", (slf,))?.extract()
    }
}

/// A table of keys and values, for small tables of texts.
pub(crate) fn pairs<'py>(py: Python<'py>, pairs: &[(String, String)]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (key, value) in pairs {
        dict.set_item(key, value)?;
    }
    Ok(dict)
}
