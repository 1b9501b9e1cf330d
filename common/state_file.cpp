#include "common/state_file.h"

#include "common/check.h"
#include "common/input_error.h"

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

}  // namespace

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
    file_.fail("format version " + std::to_string(found) + ", this program reads version " +
               std::to_string(version));
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
