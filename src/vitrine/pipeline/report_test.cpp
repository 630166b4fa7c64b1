#include "pipeline/report.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

TEST(Report, Base64OfTheStandard) {
    EXPECT_EQ(base64(""), "");
    EXPECT_EQ(base64("f"), "Zg==");
    EXPECT_EQ(base64("fo"), "Zm8=");
    EXPECT_EQ(base64("foo"), "Zm9v");
    EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
    EXPECT_EQ(base64(std::string("\xff\xfe\xfd\x00", 4)), "//79AA==");
}

TEST(Report, TextCannotBecomeMarkup) {
    EXPECT_EQ(escape_html("<a href=\"x\">&"), "&lt;a href=&quot;x&quot;&gt;&amp;");
    EXPECT_EQ(html_page("<x>", "").find("<x>"), std::string::npos);
}

}  // namespace
}  // namespace vitrine
