// telesplat-viewer: shows a session's points from where the head is, and records what it showed. It becomes
// telesplat-display if a window or a headset is to show it.
#include "client/viewer/viewer_service.h"

int main(int argc, char** argv) { return telesplat::viewer::viewer_main(argc, argv, {}); }
