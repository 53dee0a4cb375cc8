// A session as a sequence chart in text: a lane a part, a line a message that was delivered or lost, and what went
// wrong between them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/lab/simulation/session.h"

namespace telesplat::simulation {

class Chart final : public Observer {
 public:
  /// from_s, until_s: of the session; lines outside are left out. all: messages that come by time alone, too.
  Chart(double from_s, double until_s, bool all) : from_s_(from_s), until_s_(until_s), all_(all) {}

  void on_passed(const Passed& message) override;
  void on_event(const Event& event) override;
  void on_begin(Part part, int process, double now_s) override;
  void on_end(Part part, int process, double now_s, const std::string& how) override;
  /// The chart, with its lanes' names at the top and every 50 lines.
  std::string text() const;

 private:
  struct Line {
    double at_s;
    int from, to;  // lanes; to -1: a remark, from -1: no part's
    bool lost;
    std::string text;
  };
  bool shown(double now_s) const { return now_s >= from_s_ && now_s <= until_s_; }
  int lane(Part part);

  const double from_s_, until_s_;
  const bool all_;
  std::map<int, int> lanes_;  // by process
  std::vector<Part> parts_;   // by lane
  std::vector<Line> lines_;
};

}  // namespace telesplat::simulation
