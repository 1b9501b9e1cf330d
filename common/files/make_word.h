#pragma once

#include <string>
#include <vector>

namespace archetide {

/// A file name as one word of a makefile, with spaces, `#`, `:` and `$` escaped. Throws InputError
/// with the name when it holds what no makefile can hold as a name (line breaks, tabs, `%`, `=`,
/// ..): it would mean something else there.
std::string make_word(const std::string& path);

/// `target` depends on `files`. Each file also gets a rule without commands: one that was deleted
/// or renamed does not stop make. Throws InputError as above.
std::string make_fragment(const std::string& target, const std::vector<std::string>& files);

}  // namespace archetide
