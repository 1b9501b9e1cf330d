#pragma once

#include "common/files/state_file.h"
#include "runtime/grid/grid.h"

namespace archetide {

/// Grid arrays in a state file; their size is that of the scene.
template <class T>
void grid_field(StateArchive& a, const std::string& name, Array3<T>& x) {
  a.block(name, x.data(),
          {static_cast<std::size_t>(x.nz()), static_cast<std::size_t>(x.ny()),
           static_cast<std::size_t>(x.nx())});
}

template <class T>
void grid_field(StateArchive& a, const std::string& name, FaceField<T>& x) {
  const char* const axes[] = {"_x", "_y", "_z"};
  for (int c = 0; c < 3; ++c) grid_field(a, name + axes[c], x[c]);
}

}  // namespace archetide
