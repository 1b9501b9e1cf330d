#pragma once

#include <string>
#include <string_view>

namespace archetide {

/// A file under construction: it is written as X.part and becomes X, whole and on disk, at
/// commit(). Without a commit the part is removed and an older X stays as it was.
class AtomicFile {
 public:
  /// Throws MachineError at once when the folder of `path` does not exist or is not writable.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::string& part() const { return part_; }
  /// Syncs X.part to the disk and renames it to X. Throws MachineError.
  void commit();

 private:
  std::string path_, part_;
  bool committed_ = false;
};

/// Creates the folder of a file that is about to be written; the writer reports a failure.
void make_folder_of(const std::string& path);

/// The whole of a small file at once. Throws MachineError.
void write_file_atomically(const std::string& path, std::string_view bytes);

}  // namespace archetide
