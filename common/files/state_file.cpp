#include "common/files/state_file.h"

#include <fmt/core.h>

#include <cmath>
#include <cstring>

#include "common/base/check.h"
#include "common/base/input_error.h"

namespace archetide {
namespace {

// Name, type, shape and bytes of a field.
void add_to_hash(Sha256& hash, const std::string& name, const DataArray& data) {
  hash.update(name);
  const auto type = static_cast<std::uint8_t>(data.type);
  hash.update(&type, 1);
  for (const std::uint64_t n : data.shape) hash.update(&n, sizeof n);
  hash.update(data.bytes.data(), data.bytes.size());
}

template <class T>
bool all_finite(const std::vector<char>& bytes) {
  for (std::size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T)) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    if (!std::isfinite(value)) return false;
  }
  return true;
}

// What spoils everything that it meets.
bool has_non_numbers(const DataArray& data) {
  if (data.type == DataArray::Type::kFloat64) return !all_finite<double>(data.bytes);
  return data.type == DataArray::Type::kFloat32 && !all_finite<float>(data.bytes);
}

// What a run has not measured yet is NaN in its own records.
bool may_be_unset(const std::string& name) {
  return name.starts_with("limits/") || name.starts_with("expect/") || name.starts_with("run/");
}

}  // namespace

DataArray StateArchive::checked(const std::string& name) {
  DataArray data = load(name);
  if (has_non_numbers(data) && !may_be_unset(name))
    fail("field " + name + " holds something that is not a number");
  return data;
}

StateWriter::StateWriter(const std::string& path, const std::string& format, int version)
    : path_(path), file_(path) {
  file_.attribute("format", format);
  file_.attribute("format_version", version);
}

void StateWriter::fail(const std::string& what) const { throw AssertionError(path_ + ": " + what); }

void StateWriter::store(const std::string& name, DataArray data) {
  add_to_hash(hash_, name, data);
  file_.write(name, data, "SI", "");
}

DataArray StateWriter::load(const std::string&) {
  throw AssertionError(path_ + ": read while it is written");
}

std::string StateWriter::commit() {
  const std::string hash = hash_.hex();
  file_.attribute("content_hash", hash);
  file_.commit();
  return hash;
}

StateReader::StateReader(const std::string& path, const std::string& format, int version,
                         std::string advice)
    : file_(path, std::move(advice)) {
  if (!file_.has_attribute("format") || file_.text_attribute("format") != format)
    file_.fail("not a file of this kind (" + format + ")");
  const int found = file_.int_attribute("format_version");
  if (found != version)
    file_.fail(fmt::format("format version {}, this program reads version {}", found, version));
}

void StateReader::store(const std::string&, DataArray) {
  throw AssertionError("a state file is written while it is read");
}

DataArray StateReader::load(const std::string& name) {
  DataArray data = file_.read(name);
  add_to_hash(hash_, name, data);
  return data;
}

void StateReader::demand_hash() {
  if (file_.text_attribute("content_hash") != hash_.hex())
    file_.fail("the contents do not match their hash (damaged or changed by hand)");
}

}  // namespace archetide
