#include "common/files/hdf5_file.h"

#include <hdf5.h>

#include <array>
#include <filesystem>
#include <optional>
#include <system_error>

#include "common/base/input_error.h"

namespace archetide {
namespace {

static_assert(sizeof(hid_t) == sizeof(std::int64_t));

/// Closes an HDF5 identifier at the end of its scope.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  hid_t id() const { return id_; }
  bool valid() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

using Type = DataArray::Type;

/// Errors are ours to report, and files ours to close: left to itself at exit, HDF5 1.10 crashes
/// when the disk was full.
void prepare_library() {
  static const herr_t no_exit_handler = H5dont_atexit();
  static_cast<void>(no_exit_handler);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

std::size_t item_bytes(Type type) {
  switch (type) {
    case Type::kFloat64:
    case Type::kInt64:
      return 8;
    case Type::kFloat32:
    case Type::kInt32:
      return 4;
    case Type::kUint8:
    case Type::kText:
      break;
  }
  return 1;
}

/// A string type of fixed length (at least 1: HDF5 has no empty strings), padded with NUL.
hid_t text_type(std::size_t bytes) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, bytes == 0 ? 1 : bytes);
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

hid_t memory_type(Type type, std::size_t text_bytes) {
  switch (type) {
    case Type::kFloat64:
      return H5Tcopy(H5T_NATIVE_DOUBLE);
    case Type::kFloat32:
      return H5Tcopy(H5T_NATIVE_FLOAT);
    case Type::kInt32:
      return H5Tcopy(H5T_NATIVE_INT32);
    case Type::kInt64:
      return H5Tcopy(H5T_NATIVE_INT64);
    case Type::kUint8:
      return H5Tcopy(H5T_NATIVE_UINT8);
    case Type::kText:
      break;
  }
  return text_type(text_bytes);
}

hid_t file_type(Type type, std::size_t text_bytes) {
  switch (type) {
    case Type::kFloat64:
      return H5Tcopy(H5T_IEEE_F64LE);
    case Type::kFloat32:
      return H5Tcopy(H5T_IEEE_F32LE);
    case Type::kInt32:
      return H5Tcopy(H5T_STD_I32LE);
    case Type::kInt64:
      return H5Tcopy(H5T_STD_I64LE);
    case Type::kUint8:
      return H5Tcopy(H5T_STD_U8LE);
    case Type::kText:
      break;
  }
  return text_type(text_bytes);
}

hid_t make_space(const DataArray& data) {
  if (data.type == Type::kText || data.shape.empty()) return H5Screate(H5S_SCALAR);
  const std::vector<hsize_t> dims(data.shape.begin(), data.shape.end());
  return H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
}

bool write_text_attribute(hid_t object, const std::string& name, const std::string& text) {
  const Handle type(text_type(text.size()), H5Tclose);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(
      H5Acreate2(object, name.c_str(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.valid() && H5Awrite(attribute.id(), type.id(), text.c_str()) >= 0;
}

/// Makes the groups "a" and "a/b" of "a/b/field" without times (intermediate groups made by HDF5
/// carry them).
bool make_groups(hid_t file, const std::string& name) {
  const Handle creation(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation.id(), false);
  for (std::size_t end = name.find('/'); end != std::string::npos; end = name.find('/', end + 1)) {
    const std::string group = name.substr(0, end);
    if (H5Lexists(file, group.c_str(), H5P_DEFAULT) > 0) continue;
    const Handle made(H5Gcreate2(file, group.c_str(), H5P_DEFAULT, creation.id(), H5P_DEFAULT),
                      H5Gclose);
    if (!made.valid()) return false;
  }
  return true;
}

void strip_padding(std::string& text) {
  while (!text.empty() && text.back() == '\0') text.pop_back();
}

}  // namespace

// ---- writing ----------------------------------------------------------------------------------

Hdf5Writer::Hdf5Writer(const std::string& path, Format format) : file_(path), path_(path) {
  prepare_library();
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // Format 1.8: its metadata carry checksums, so that a flipped bit is an error and not another
  // file.
  const H5F_libver_t version = format == Format::k18 ? H5F_LIBVER_V18 : H5F_LIBVER_V110;
  H5Pset_libver_bounds(access.id(), version, version);
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation.id(), false);
  id_ = H5Fcreate(file_.part().c_str(), H5F_ACC_TRUNC, creation.id(), access.id());
  if (id_ < 0) fail("cannot be created");
}

Hdf5Writer::~Hdf5Writer() {
  if (id_ >= 0) H5Fclose(id_);
}

void Hdf5Writer::fail(const std::string& what) const {
  throw MachineError(path_ + ": " + what + " (is the disk full, or the folder read-only?)");
}

void Hdf5Writer::write(const std::string& name, const DataArray& data, const std::string& unit,
                       const std::string& shape_text) {
  const Handle memory(memory_type(data.type, data.bytes.size()), H5Tclose);
  const Handle stored(file_type(data.type, data.bytes.size()), H5Tclose);
  const Handle space(make_space(data), H5Sclose);
  if (!make_groups(id_, name)) fail("group of " + name + " cannot be made");
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation.id(), false);
  const Handle set(H5Dcreate2(id_, name.c_str(), stored.id(), space.id(), H5P_DEFAULT,
                              creation.id(), H5P_DEFAULT),
                   H5Dclose);
  const char empty = '\0';
  const void* bytes = data.bytes.empty() ? &empty : data.bytes.data();
  const bool written = set.valid() &&
                       H5Dwrite(set.id(), memory.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes) >= 0 &&
                       write_text_attribute(set.id(), "unit", unit) &&
                       write_text_attribute(set.id(), "shape", shape_text);
  if (!written) fail("field " + name + " cannot be written");
}

void Hdf5Writer::view(const std::string& name, const std::string& source,
                      const std::vector<std::size_t>& shape, std::size_t index) {
  std::vector<hsize_t> whole(shape.begin(), shape.end()), start(shape.size(), 0), size = whole;
  start[0] = index;
  size[0] = 1;
  const Handle from(H5Screate_simple(static_cast<int>(whole.size()), whole.data(), nullptr),
                    H5Sclose);
  const Handle to(H5Screate_simple(static_cast<int>(whole.size()) - 1, whole.data() + 1, nullptr),
                  H5Sclose);
  H5Sselect_hyperslab(from.id(), H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr);
  if (!make_groups(id_, name)) fail("group of " + name + " cannot be made");
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation.id(), false);
  H5Pset_virtual(creation.id(), to.id(), ".", source.c_str(), from.id());
  const Handle set(H5Dcreate2(id_, name.c_str(), H5T_IEEE_F64LE, to.id(), H5P_DEFAULT,
                              creation.id(), H5P_DEFAULT),
                   H5Dclose);
  if (!set.valid()) fail("view " + name + " cannot be written");
}

void Hdf5Writer::group_attribute(const std::string& group, const std::string& name,
                                 const std::string& text) {
  const Handle object(H5Gopen2(id_, group.c_str(), H5P_DEFAULT), H5Gclose);
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);  // ASCII, unlike our own attributes
  H5Tset_size(type.id(), text.size());
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(
      H5Acreate2(object.id(), name.c_str(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  if (!attribute.valid() || H5Awrite(attribute.id(), type.id(), text.c_str()) < 0)
    fail("attribute " + name + " cannot be written");
}

void Hdf5Writer::group_attribute(const std::string& group, const std::string& name,
                                 const std::vector<std::int64_t>& list) {
  const Handle object(H5Gopen2(id_, group.c_str(), H5P_DEFAULT), H5Gclose);
  const hsize_t size = list.size();
  const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const Handle attribute(
      H5Acreate2(object.id(), name.c_str(), H5T_STD_I64LE, space.id(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  if (!attribute.valid() || H5Awrite(attribute.id(), H5T_NATIVE_INT64, list.data()) < 0)
    fail("attribute " + name + " cannot be written");
}

void Hdf5Writer::attribute(const std::string& name, const std::string& text) {
  if (!write_text_attribute(id_, name, text)) fail("attribute " + name + " cannot be written");
}

void Hdf5Writer::attribute(const std::string& name, int value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(
      H5Acreate2(id_, name.c_str(), H5T_STD_I32LE, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!attribute.valid() || H5Awrite(attribute.id(), H5T_NATIVE_INT, &value) < 0) {
    fail("attribute " + name + " cannot be written");
  }
}

void Hdf5Writer::commit() {
  const herr_t closed = H5Fclose(id_);
  id_ = -1;
  if (closed < 0) fail("cannot be completed");
  file_.commit();
}

// ---- reading ----------------------------------------------------------------------------------

namespace {

/// One item: there is room for no more where it goes.
bool is_single(hid_t space) { return H5Sget_simple_extent_npoints(space) == 1; }

/// Whether every part of the name "a/b/c" is in this file itself: links lead to other files.
bool stands_in_file(hid_t file, const std::string& name) {
  for (std::size_t end = 0; end != name.npos;) {
    end = name.find('/', end + 1);
    H5L_info_t info;
    if (H5Lget_info(file, name.substr(0, end).c_str(), &info, H5P_DEFAULT) < 0 ||
        info.type != H5L_TYPE_HARD)
      return false;
  }
  return true;
}

/// Whether the numbers of a data set are in other files; nothing of an object that is damaged. It is
/// asked before the data set is opened: libhdf5 reads on where the name of such a file does not end.
std::optional<bool> is_elsewhere(hid_t file, const std::string& name) {
  constexpr unsigned kExternalFiles = 7;  // kind of message in an object's header
#if H5_VERSION_GE(1, 12, 0)
  H5O_native_info_t info;
  const herr_t got =
      H5Oget_native_info_by_name(file, name.c_str(), &info, H5O_NATIVE_INFO_HDR, H5P_DEFAULT);
#else
  H5O_info_t info;
  const herr_t got = H5Oget_info_by_name2(file, name.c_str(), &info, H5O_INFO_HDR, H5P_DEFAULT);
#endif
  if (got < 0) return std::nullopt;
  return (info.hdr.mesg.present >> kExternalFiles & 1) != 0;
}

/// Numbers one after the other, as our files hold them: not packed, nor put together from other data
/// sets.
bool is_plain(hid_t set) {
  const Handle creation(H5Dget_create_plist(set), H5Pclose);
  if (!creation.valid() || H5Pget_nfilters(creation.id()) != 0) return false;
  const H5D_layout_t layout = H5Pget_layout(creation.id());
  return layout == H5D_CONTIGUOUS || layout == H5D_COMPACT;
}

}  // namespace

Hdf5Reader::Hdf5Reader(const std::string& path, std::string advice)
    : path_(path), advice_(std::move(advice)) {
  prepare_library();
  std::error_code problem;
  if (!std::filesystem::exists(path, problem)) fail("no such file");
  if (!std::filesystem::is_regular_file(path, problem)) fail("not a file");
  file_bytes_ = std::filesystem::file_size(path, problem);
  if (problem) fail("cannot be read: " + problem.message());
  const htri_t is_hdf5 = H5Fis_hdf5(path.c_str());
  if (is_hdf5 < 0) fail("cannot be read");
  if (is_hdf5 == 0) fail("not an HDF5 file");
  id_ = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (id_ < 0) fail("truncated or damaged");
}

Hdf5Reader::~Hdf5Reader() {
  if (id_ >= 0) H5Fclose(id_);
}

void Hdf5Reader::fail(const std::string& what) const {
  throw FileError(path_ + ": " + what + (advice_.empty() ? "" : "; " + advice_));
}

DataArray Hdf5Reader::read(const std::string& name) const {
  const std::string damaged = "field " + name + " is missing or damaged",
                    not_plain = "field " + name + " is not stored as plain numbers in this file";
  if (!stands_in_file(id_, name)) fail(damaged);
  const std::optional<bool> elsewhere = is_elsewhere(id_, name);
  if (!elsewhere) fail(damaged);
  if (*elsewhere) fail(not_plain);
  const Handle set(H5Dopen2(id_, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.valid()) fail(damaged);
  if (!is_plain(set.id())) fail(not_plain);
  const Handle stored(H5Dget_type(set.id()), H5Tclose);
  const Handle space(H5Dget_space(set.id()), H5Sclose);

  // Find the type and shape.
  DataArray data;
  const H5T_class_t kind = H5Tget_class(stored.id());
  const std::size_t size = H5Tget_size(stored.id());
  if (kind == H5T_STRING && H5Tis_variable_str(stored.id()) == 0) {
    if (!is_single(space.id())) fail("field " + name + " holds more than one text");
    data.type = Type::kText;
    data.shape = {size};
  } else {
    if (kind == H5T_FLOAT && size == 8)
      data.type = Type::kFloat64;
    else if (kind == H5T_FLOAT && size == 4)
      data.type = Type::kFloat32;
    else if (kind == H5T_INTEGER && size == 4)
      data.type = Type::kInt32;
    else if (kind == H5T_INTEGER && size == 8)
      data.type = Type::kInt64;
    else if (kind == H5T_INTEGER && size == 1)
      data.type = Type::kUint8;
    else
      fail("field " + name + " has a type that this program does not read");
    const int rank = H5Sget_simple_extent_ndims(space.id());
    if (rank < 0 || rank > 8) fail("field " + name + " is damaged");
    std::array<hsize_t, 8> dims{};
    H5Sget_simple_extent_dims(space.id(), dims.data(), nullptr);
    data.shape.assign(dims.begin(), dims.begin() + rank);
  }

  // A damaged shape must not make us allocate more memory than the file can fill.
  std::size_t bytes = item_bytes(data.type);
  for (const std::size_t n : data.shape) {
    if (n > 0 && bytes > file_bytes_ / n) fail("field " + name + " is longer than the file");
    bytes *= n;
  }
  data.bytes.resize(bytes);
  const Handle memory(memory_type(data.type, bytes), H5Tclose);
  if (bytes > 0 &&
      H5Dread(set.id(), memory.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, data.bytes.data()) < 0) {
    fail("field " + name + " cannot be read: truncated or damaged");
  }
  if (data.type == Type::kText) {
    while (!data.bytes.empty() && data.bytes.back() == '\0') data.bytes.pop_back();
    data.shape = {data.bytes.size()};
  }
  return data;
}

bool Hdf5Reader::has_attribute(const std::string& name) const {
  return H5Aexists(id_, name.c_str()) > 0;
}

std::string Hdf5Reader::text_attribute(const std::string& name) const {
  const Handle attribute(H5Aopen(id_, name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!attribute.valid()) fail("attribute " + name + " is missing");
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  if (H5Tget_class(type.id()) != H5T_STRING || H5Tis_variable_str(type.id()) != 0) {
    fail("attribute " + name + " is not a text");
  }
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  if (!is_single(space.id())) fail("attribute " + name + " holds more than one text");
  std::string text(H5Tget_size(type.id()), '\0');
  if (text.size() > file_bytes_ || H5Aread(attribute.id(), type.id(), text.data()) < 0) {
    fail("attribute " + name + " cannot be read");
  }
  strip_padding(text);
  return text;
}

int Hdf5Reader::int_attribute(const std::string& name) const {
  const Handle attribute(H5Aopen(id_, name.c_str(), H5P_DEFAULT), H5Aclose);
  int value = 0;
  if (!attribute.valid()) fail("attribute " + name + " is missing");
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  if (!is_single(space.id()) || H5Aread(attribute.id(), H5T_NATIVE_INT, &value) < 0) {
    fail("attribute " + name + " is missing or not a number");
  }
  return value;
}

}  // namespace archetide
