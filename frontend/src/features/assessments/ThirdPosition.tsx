import { Group, Text } from "@mantine/core";
import { t } from "../../lib/i18n";
import picture from "./third-position.svg";

/** Shows the zero of rotation with the arm raised forward, as a picture and in words. */
export function ThirdPosition() {
  return (
    <Group align="start" wrap="wrap" component="figure" m={0}>
      <img
        src={picture}
        width={300}
        height={220}
        alt={t("assessments:rom.thirdPositionPicture")}
        style={{ background: "white", borderRadius: 8 }}
      />
      <Text size="sm" component="figcaption" maw={480}>
        {t("assessments:rom.thirdPosition")}
      </Text>
    </Group>
  );
}
