// The display in a headset: every refresh shows what is cached to both eyes, from where the runtime says that they will
// be then, even if the server is late.
#pragma once

#include "client/viewer/display/display_loop.h"
#include "client/viewer/xr/headset_session.h"

namespace telesplat::viewer {

/// What there is before the session begins: a runtime with a headset, and a context of OpenGL for its textures.
class XrDevice {
 public:
  /// Error: what there is not.
  static Result<std::unique_ptr<XrDevice>> open();
  /// Anew, where the runtime went away.
  Status reopen();
  const XrSystem& system() const { return *system_; }
  const gl::EglContext& context() const { return *context_; }

 private:
  std::unique_ptr<gl::EglContext> context_;
  std::unique_ptr<XrSystem> system_;
};

/// SourceMaker, for a display that draws so many pictures a second.
using XrSourceMaker = std::function<Result<std::unique_ptr<ViewSource>>(Received&, double pictures_s)>;

/// Displays until told to stop, the person quits, or options.duration_s or frames are over, counted from the first
/// frame after the first complete view update. The runtime's clock paces frames; options.target_fps means nothing. A
/// session that is lost is opened anew every second, as long as nobody says stop. tell: lines for the person. Pictures
/// that the spool keeps are the left eye's.
DisplayResult run_xr_display(const DisplayOptions& options, const XrOptions& xr, XrDevice& device,
                             const XrSourceMaker& make_source, ViewerWorker& worker, metrics::TableRecorder& frames,
                             metrics::SpanRecorder& spans, const std::function<FrameSpool*()>& spool,
                             const std::function<void(const std::string&)>& tell);

}  // namespace telesplat::viewer
