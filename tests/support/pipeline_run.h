// A `telesplat run` in processes of its own, for end-to-end tests: started, watched, hurt, and always ended.
#pragma once

#include <sys/types.h>

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/image/file.h"
#include "common/net/keys/access.h"
#include "tests/support/files/made_data.h"

namespace telesplat::launcher {
class ControlClient;
}

namespace telesplat::test {

/// Asks `condition` until it holds. False: it did not within `deadline_s`, which like all deadlines here is that of
/// ordinary builds (patience.h).
bool wait_until(const std::function<bool()>& condition, double deadline_s = 30);

/// True if a process runs (a zombie does not).
bool is_running(pid_t pid);

/// A program of the build's bin folder, or one with an absolute path.
class Program {
 public:
  /// stdout and stderr go to `prefix`.out and `prefix`.err. Only processes with the same TELESPLAT_RUNTIME in their
  /// environment find its sessions; without one, it gets its own.
  Program(const std::string& name, std::vector<std::string> arguments, const std::string& prefix);
  ~Program();  ///< kills it if it still runs
  pid_t pid() const { return pid_; }
  /// Returns the exit code or 128 + signal; -1: it still runs after `deadline_s`.
  int wait(double deadline_s = 60);
  void signal(int number);
  std::string out() const { return read_text(prefix_ + ".out"); }
  std::string err() const { return read_text(prefix_ + ".err"); }
  /// Returns err() without its first line, which has the session's address.
  std::string complaint() const;

 private:
  std::string prefix_;
  pid_t pid_ = -1;
  int exit_code_ = -1;
};

/// Where a master that was started by hand listens; waits until it says so.
std::string address_of(const Program& master);

/// Flags of a run whose head moves for two seconds and then stands, until the test stops it after wait_at_rest().
inline const std::vector<std::string> kComesToRest{"--duration", "60", "--hold", "58"};

/// `telesplat run` of a small terrain at a small size with its cache and record in a temporary folder.
class PipelineRun {
 public:
  /// Adds `arguments`; `mesh`: another mesh than the terrain; `command`: run or view.
  explicit PipelineRun(const std::vector<std::string>& arguments, const std::string& mesh = "",
                       const std::string& command = "run");
  ~PipelineRun();

  Program& program() { return *program_; }
  const std::string& out() const { return out_; }
  const TemporaryFolder& folder() const { return folder_; }
  /// Returns keys for asking its master. A run has its own keys; its session's file names them to this test and to
  /// programs that it starts.
  const net::Access& access();
  /// Names the keys of the session: status() and stop() use them.
  void use_keys(const std::string& keys, net::Access operators);
  /// Returns the master's address; waits for it.
  const std::string& master();
  /// Returns the answer of `telesplat ctl status`; empty without an answer.
  nlohmann::json status();
  /// Polls status until `condition` holds.
  bool wait_status(const std::function<bool(const nlohmann::json&)>& condition, double deadline_s = 40);
  /// Waits until the viewer shows points.
  bool wait_showing();
  /// Waits until the head of a run with kComesToRest stands and three more view updates gave no viewer new points: from
  /// then on the picture does not depend on how busy the machine is.
  bool wait_at_rest();
  /// Commands the session to stop; returns the run's exit code.
  int stop();
  /// True if all processes of the run have ended within `deadline_s`.
  bool all_gone(double deadline_s = 20);

  nlohmann::json summary() const;
  /// Returns a column of a CSV file of the record, as numbers.
  std::vector<double> column(const std::string& file, const std::string& name) const;

 private:
  TemporaryFolder folder_;
  std::string out_, master_, keys_;
  bool own_runtime_ = false;  // TELESPLAT_RUNTIME is set by this object
  std::optional<net::Access> access_;
  std::unique_ptr<Program> program_;
  std::unique_ptr<launcher::ControlClient> control_;
};

/// Runs `telesplat ctl` about the run's session; its exit code, and what it says.
int ctl(PipelineRun& run, std::vector<std::string> arguments, std::string* out = nullptr, std::string* err = nullptr);

/// Looks into a status answer: the living process of this name, or null.
nlohmann::json process(const nlohmann::json& status, const std::string& name);
/// Returns its value, 0 if it has none.
double value(const nlohmann::json& status, const std::string& name, const std::string& key);

/// The last picture of a displayed frame that the run recorded; empty: the run recorded no picture.
std::string newest_picture(const PipelineRun& run);
/// Over all pixels, those of the background too; 99 where they are the same.
double psnr_db(const image::View& a, const image::View& b);

/// Returns the numbers of the displayed frames that a movie of the run in this folder must show, one for each of its
/// `fps` frames a second.
std::vector<uint64_t> on_screen(const std::string& run, double fps);
/// Makes a folder of pictures of the run, which recorded every frame, and expects each to equal the recorded one.
/// Returns the number of compared pictures: the disk may have been too slow for some.
size_t expect_as_displayed(const PipelineRun& run, double fps);

}  // namespace telesplat::test
