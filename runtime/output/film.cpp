#include "runtime/output/film.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <vector>

#include "common/base/number_text.h"
#include "common/files/atomic_file.h"

extern char** environ;

namespace archetide {
namespace {

// Exit code of a program found on PATH, 127 when there is none; its output is dropped.
int run_program(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  pid_t child = 0;
  const int failed =
      posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed) return 127;
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

// A name that ffmpeg takes as it is: ':' would name a protocol, '-' an option.
std::string plain_name(const std::string& path) { return "file:" + path; }

// The pictures of a folder, whose own name may hold '%'.
std::string numbered_pictures(const std::string& folder) {
  std::string name;
  for (const char c : folder) name += c == '%' ? "%%" : std::string(1, c);
  return plain_name(name + "frame.%06d.png");
}

std::vector<std::string> ffmpeg_words(const std::string& folder, int first, int count, double fps,
                                      const std::vector<std::string>& codec,
                                      const std::string& film) {
  std::vector<std::string> words = {"ffmpeg", "-y", "-nostdin", "-framerate", number_text(fps),
                                    "-start_number", std::to_string(first), "-i",
                                    numbered_pictures(folder), "-frames:v", std::to_string(count),
                                    // 4:2:0 needs even sides.
                                    "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2"};
  words.insert(words.end(), codec.begin(), codec.end());
  words.insert(words.end(),
               {"-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", plain_name(film)});
  return words;
}

}  // namespace

std::string make_film(const std::string& folder, int first, int count, double fps,
                      const std::string& film) {
  if (run_program({"ffmpeg", "-version"}) != 0) return "film: off (needs ffmpeg)";
  const std::vector<std::vector<std::string>> codecs = {
      {"-c:v", "libx264", "-crf", "18", "-preset", "medium"}, {"-c:v", "mpeg4", "-q:v", "3"}};
  AtomicFile file(film);
  for (const auto& codec : codecs)
    if (run_program(ffmpeg_words(folder, first, count, fps, codec, file.part())) == 0) {
      file.commit();
      return "";
    }
  return "film: off (ffmpeg wrote neither H.264 nor MPEG-4)";
}

}  // namespace archetide
