// A `telesplat run` in processes of its own, for end-to-end tests: started, watched, hurt, and always ended.
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/net/keys/access.h"

namespace telesplat::launcher {
class ControlClient;
}

namespace telesplat::test {

/// A folder that goes when the object does.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/// Writes a coloured, bumpy terrain of 2 * cells^2 triangles as binary PLY.
void write_terrain(const std::string& path, int cells = 100);

/// Writes a volume of `side`^3 voxels as MetaImage (.mha), 8 bit: two soft balls of 200 and 140 that pass into each
/// other, a rod of 255 through them, 0 around. `turn` moves the smaller ball around the larger: 0 to 1 is once around.
void write_volume(const std::string& path, int side = 40, double turn = 0);

std::string read_text(const std::string& path);

/// Asks `condition` until it holds. False: it did not within `deadline_s`, which like all deadlines here is that of
/// ordinary builds (patience.h).
bool wait_until(const std::function<bool()>& condition, double deadline_s = 30);

/// Whether a process runs (a zombie does not).
bool is_running(pid_t pid);

/// A program of the build's bin folder, or one with an absolute path.
class Program {
 public:
  /// stdout and stderr go to `prefix`.out and `prefix`.err. Its sessions are found by those alone who have the same
  /// TELESPLAT_RUNTIME in their environment; where that is not set, it gets one of its own.
  Program(const std::string& name, std::vector<std::string> arguments, const std::string& prefix);
  ~Program();  ///< kills it if it still runs
  pid_t pid() const { return pid_; }
  /// Exit code or 128 + signal; -1: it still runs after `deadline_s`.
  int wait(double deadline_s = 60);
  void signal(int number);
  std::string out() const { return read_text(prefix_ + ".out"); }
  std::string err() const { return read_text(prefix_ + ".err"); }
  /// err() without the line that tells a session's address, which a run begins with.
  std::string complaint() const;

 private:
  std::string prefix_;
  pid_t pid_ = -1;
  int exit_code_ = -1;
};

/// Flags of a run whose head moves for two seconds and then stands, until the test stops it after wait_at_rest().
inline const std::vector<std::string> kComesToRest{"--duration", "60", "--hold", "58"};

/// `telesplat run` of a small terrain at a small size with its cache and record in a temporary folder.
class PipelineRun {
 public:
  /// `arguments` are added; `mesh`: another mesh than the terrain; `command`: run or view.
  explicit PipelineRun(const std::vector<std::string>& arguments, const std::string& mesh = "",
                       const std::string& command = "run");
  ~PipelineRun();

  Program& program() { return *program_; }
  const std::string& out() const { return out_; }
  const TemporaryFolder& folder() const { return folder_; }
  /// By which its master is asked. A run has keys of its own, which its session's file names to this test and to
  /// programs that it starts.
  const net::Access& access();
  /// The session has keys of this folder: status() and stop() take these.
  void use_keys(const std::string& keys, net::Access operators);
  /// The master's address; waits for it.
  const std::string& master();
  /// `telesplat ctl status`; empty if there is no answer.
  nlohmann::json status();
  /// Polls status until `condition` holds.
  bool wait_status(const std::function<bool(const nlohmann::json&)>& condition, double deadline_s = 40);
  /// Waits until the viewer shows points.
  bool wait_showing();
  /// Waits until the head of a run with kComesToRest stands and three more view updates gave no viewer new points: what
  /// is displayed then does not depend on how busy the machine is.
  bool wait_at_rest();
  /// Commands the session to stop; the run's exit code.
  int stop();
  /// Whether none of the processes that took part runs any more, within `deadline_s`.
  bool all_gone(double deadline_s = 20);

  nlohmann::json summary() const;
  /// A column of a CSV file of the record, as numbers.
  std::vector<double> column(const std::string& file, const std::string& name) const;

 private:
  TemporaryFolder folder_;
  std::string out_, master_, keys_;
  bool own_runtime_ = false;  // TELESPLAT_RUNTIME is set by this object
  std::optional<net::Access> access_;
  std::unique_ptr<Program> program_;
  std::unique_ptr<launcher::ControlClient> control_;
};

/// Looks into a status answer: the living process of this name, or null.
nlohmann::json process(const nlohmann::json& status, const std::string& name);
/// Its value, 0 if it has none.
double value(const nlohmann::json& status, const std::string& name, const std::string& key);

/// What a movie of `fps` frames a second of the run in this folder must show: for each of its frames the number of the
/// displayed one.
std::vector<uint64_t> on_screen(const std::string& run, double fps);
/// Makes a folder of pictures of the run, which recorded every frame, and expects each to be the recorded one. Returns
/// how many were compared: the disk may not have kept up.
size_t expect_as_displayed(const PipelineRun& run, double fps);

}  // namespace telesplat::test
