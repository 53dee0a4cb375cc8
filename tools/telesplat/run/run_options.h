// Options of `telesplat run` and `telesplat view`: those of all services, and the launcher's own.
#pragma once

#include <map>
#include <memory>

#include "client/viewer/viewer_options.h"
#include "common/links/link.h"
#include "services/data/data_options.h"
#include "services/master/master_options.h"
#include "services/packer/packer_options.h"
#include "services/sampler/sampler_options.h"
#include "tools/telesplat/movie/movie_target.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

/// viewer.window: `view`, not `run`.
struct RunOptions {
  data::DataServiceOptions data;
  master::MasterServiceOptions master;
  packer::PackerOptions packer;
  sampler::SamplerOptions sampler;  ///< threads, memory_mb 0: the machine's shared among the samplers
  viewer::ViewerOptions viewer;     ///< wall "2x1": the viewers are its tiles; started_s: begin of the command
  int samplers = 1, data_servers = 1, viewers = 1;
  std::string join_master;                    ///< --master: join a running session instead of starting one
  std::string keys = "auto";                  ///< keys of all processes: a folder; auto: made for this run, or those of
                                              ///< the joined session; none, empty: no keys
  MovieOptions movie;                         ///< the movie to make after the run; no file: no movie
  bool report = false;                        ///< makes a report at the end (tools/telesplat/report/report.h)
  std::string out;                            ///< run folder; empty: run makes one, view records nothing
  bool overwrite = false;                     ///< replaces a record in `out`
  std::string log_directory;                  ///< logs of all processes; empty: OUT/logs
  std::string log_level = "info";             ///< for all processes
  std::vector<std::string> link_texts;        ///< --link as given
  std::map<links::Place, links::Link> links;  ///< link_texts as simulated links; local ones are left out
  int verify_samples = 16;                    ///< rays a pixel of the pictures that verify displayed frames
  bool record_depth = false;                  ///< keep sampled depth images in OUT/depth
};

/// Defaults of `telesplat view`: a window until it is closed, with the camera in the person's hands.
RunOptions view_defaults();

/// Returns the flags of `run`, or of `view` if options.viewer.window is set: the launcher's own and those of the
/// services. They point into `options`.
options::Table table(RunOptions& options);

/// Call after the flags are read: finds the scene, refuses flags that it does not have, and sets options that follow
/// from others (a wall has as many viewers as tiles). given: the flags of the command line. The scene is null if a
/// session is joined without a scene on the command line.
Result<std::shared_ptr<Scene>> settle(RunOptions& options, const options::Given& given);
/// Refuses --coupling images for a scene that does not travel as points. scene: null: no scene is open yet.
Status check_pictures(const RunOptions& options, const Scene* scene);

/// Arguments of each process, without its name, its log level and the master's address. They include a service's flag
/// if its value is not the program's default; the launcher names none of these flags.
std::vector<std::string> master_arguments(const RunOptions& options);
/// part: 0 to options.data_servers - 1.
std::vector<std::string> data_arguments(const RunOptions& options, int part);
std::vector<std::string> packer_arguments(const RunOptions& options);
std::vector<std::string> sampler_arguments(const RunOptions& options);
/// number: 1 to options.viewers. Only the first viewer's frames are verified. clock_from_s: begin of a wall's
/// trajectory, on the monotonic clock; 0: each viewer's begins with its first frame.
std::vector<std::string> viewer_arguments(const RunOptions& options, int number, double clock_from_s);

/// Returns "runs/PREFIX20260131-142500", by this machine's clock; with "-2", "-3" ... if that folder exists.
std::string dated_folder(const std::string& prefix = "");

/// Call before the record in options.out is removed. Error: a running session records into it, or it contains a file
/// that the run will read.
Status check_overwrite(const RunOptions& options);

}  // namespace telesplat::launcher
