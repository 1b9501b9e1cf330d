#include "tests/fuzz/field_edits.h"

#include <algorithm>
#include <iterator>

namespace archetide {
namespace {

constexpr std::size_t kMostItems = 1 << 12;  // of a field after a change

std::size_t item_size(DataArray::Type type) {
  using enum DataArray::Type;
  return type == kFloat64 || type == kInt64 ? 8 : type == kFloat32 || type == kInt32 ? 4 : 1;
}

/// As many bytes as the shape says; at most kMostItems.
void fit(DataArray& field) {
  std::size_t items = 1;
  for (std::size_t& n : field.shape) {
    n = std::min(n, kMostItems / std::max<std::size_t>(items, 1));
    items *= n;
  }
  field.bytes.resize(items * item_size(field.type));
}

void overwrite(DataArray& field, std::size_t at, std::uint64_t value) {
  const std::size_t size = item_size(field.type);
  if (field.bytes.size() < size) return;
  std::memcpy(field.bytes.data() + at % (field.bytes.size() / size) * size, &value, size);
}

}  // namespace

void edit_fields(std::string_view input, FieldMap& fields) {
  InputBytes in(input);
  while (!in.empty() && !fields.empty()) {
    const auto chosen = std::next(fields.begin(), in.take<std::uint8_t>() % fields.size());
    DataArray& field = chosen->second;
    const auto kind = in.take<std::uint8_t>();
    const auto at = in.take<std::uint16_t>();
    switch (kind % 8) {
      case 0:
        fields.erase(chosen);
        break;
      case 1:
        field.type = static_cast<DataArray::Type>(at % 6);
        if (field.type == DataArray::Type::kText) field.shape.resize(1);
        fit(field);
        break;
      case 2:
        if (!field.shape.empty()) field.shape[at % field.shape.size()] = in.take<std::uint8_t>();
        fit(field);
        break;
      default:
        overwrite(field, at, in.take<std::uint64_t>());
        break;
    }
  }
}

}  // namespace archetide
