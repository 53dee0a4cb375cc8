// What `telesplat run` and `telesplat view` are told: the options of all services, and the launcher's own.
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

/// viewer.window tells `view` from `run`.
struct RunOptions {
  data::DataServiceOptions data;
  master::MasterServiceOptions master;
  packer::PackerOptions packer;
  sampler::SamplerOptions sampler;  ///< threads 0: the machine's cores shared among the samplers
  viewer::ViewerOptions viewer;     ///< wall "2x1": the viewers are its tiles; started_s: when the command began
  int samplers = 1, data_servers = 1, viewers = 1;
  std::string join_master;                    ///< --master: join a running session instead of starting one
  std::string keys = "auto";                  ///< folder of keys, of all processes; auto: made for this run, or those
                                              ///< of the session that is joined; none, empty: without
  MovieOptions movie;                         ///< made of the record after the run; no file: none
  bool report = false;                        ///< made of the record at the end (tools/telesplat/report/report.h)
  std::string out;                            ///< run folder; empty: run makes one, view records nothing
  bool overwrite = false;                     ///< `out` may hold a record already, which is replaced
  std::string log_directory;                  ///< of the processes; empty: OUT/logs
  std::string log_level = "info";             ///< of the processes
  std::vector<std::string> link_texts;        ///< --link as given
  std::map<links::Place, links::Link> links;  ///< what they come to: simulated, none of them local
  int verify_samples = 16;    ///< rays a pixel of the pictures that displayed frames are verified against
  bool record_depth = false;  ///< keep sampled depth images in OUT/depth
};

/// What `telesplat view` does unless told otherwise: a window, until it is closed, with the camera in the person's
/// hands.
RunOptions view_defaults();

/// Flags of `run`, or of `view` if options.viewer.window is set: the launcher's own and those of the services. They
/// point into `options`.
options::Table table(RunOptions& options);

/// Once the flags are read: finds out what the scene is, refuses flags that it does not have, and sets what follows
/// from others (a wall has as many viewers as tiles). given: the flags of the command line. The scene is null where a
/// session is joined and none is named.
Result<std::shared_ptr<Scene>> settle(RunOptions& options, const options::Given& given);
/// Views of what travels as points alone can come as pictures (--coupling images). scene: null: none is shown yet.
Status check_pictures(const RunOptions& options, const Scene* scene);

/// What each process is told, beside its name, its log level and the master's address. A service's flag that is not as
/// its program has it anyway is among them; the launcher knows none of them by name.
std::vector<std::string> master_arguments(const RunOptions& options);
/// part: 0 to options.data_servers - 1.
std::vector<std::string> data_arguments(const RunOptions& options, int part);
std::vector<std::string> packer_arguments(const RunOptions& options);
std::vector<std::string> sampler_arguments(const RunOptions& options);
/// number: 1 to options.viewers. Only the first one's frames are verified. clock_from_s: when the trajectory of a wall
/// begins, on the monotonic clock; 0: each viewer's begins with its first frame.
std::vector<std::string> viewer_arguments(const RunOptions& options, int number, double clock_from_s);

/// "runs/PREFIX20260131-142500", by this machine's clock; with "-2", "-3" ... where that is there already.
std::string dated_folder(const std::string& prefix = "");

/// Before the record in options.out is removed. Error: a session that runs records into it, or a file that the run is
/// to read is part of it.
Status check_overwrite(const RunOptions& options);

}  // namespace telesplat::launcher
