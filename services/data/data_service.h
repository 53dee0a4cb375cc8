// The data server process (T5.2.1): opens the data set, says hello, serves whoever asks.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/net/turns.h"
#include "services/data/data_options.h"
#include "services/data/served.h"

namespace telesplat::data {

/// What the session is told of the data set; all text in it is UTF-8, even where a file's name is not. endpoint: where
/// requests go to; empty: nowhere.
wire::Hello make_hello(const Served& served, const std::string& name, const std::string& endpoint);

/// What the record of a run is told beside: facts, and files whose size and hash follow when they are known.
struct Recorded {
  std::map<std::string, std::string> facts;
  std::vector<std::string> files;
};

/// The process that serves: it says hello, answers until told to stop, and says goodbye.
class DataService : public net::Turns {
 public:
  /// Binds. Error: that cannot be done. Context and `served` must outlive it.
  static Result<std::unique_ptr<DataService>> open(net::Context& context, Served& served,
                                                   const net::ServiceOptions& options, const Recorded& recorded = {},
                                                   std::function<bool()> stop = {});
  virtual int exit_code() const = 0;
};

/// Takes its turns until told to stop; `stop` ends it, too. Exit code: 0, or 2 if nothing can be bound.
int serve(net::Context& context, Served& served, const net::ServiceOptions& options, const std::function<bool()>& stop,
          const Recorded& recorded = {});

/// Opens the data set and serves it until told to stop. Exit code: 0, or 2 if the data cannot be read (one line on
/// stderr says why).
Result<int> run(const DataServiceOptions& options);

}  // namespace telesplat::data
