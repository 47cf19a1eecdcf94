import { Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { describeLimit } from "./messages";

/** The doctor's limits of an episode. Renders nothing without limits. */
export function DoctorsLimits({ episode, size = "md" }: { episode: Schemas["Episode"]; size?: "sm" | "md" }) {
  if (!episode.limits_by) return null;
  return (
    <div data-testid="limits">
      <Text fw={700} size={size}>
        {t("episodes:care.allowedBy", { doctor: episode.limits_by })}
      </Text>
      {episode.limits.map((limit) => (
        <Text key={limit.motion} size={size}>
          {describeLimit(limit)}
        </Text>
      ))}
      {episode.max_resistance_level !== null && (
        <Text size={size}>{t("episodes:care.levelAtMost", { level: episode.max_resistance_level })}</Text>
      )}
      {episode.max_speed_deg_s !== null && (
        <Text size={size}>{t("episodes:care.speedAtMost", { degPerSecond: episode.max_speed_deg_s })}</Text>
      )}
      {episode.self_paced_permitted && <Text size={size}>{t("episodes:care.selfPaced")}</Text>}
    </div>
  );
}
