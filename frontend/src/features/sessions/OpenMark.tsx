import { Badge } from "@mantine/core";
import { IconHourglass } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";

/** Marks a session that has not ended, in a row of a list. */
export function OpenMark({ session }: { session: Pick<Schemas["SessionSummary"], "ended_at"> }) {
  if (session.ended_at !== null) return null;
  return (
    <Badge
      variant="light"
      tt="none"
      miw="max-content"
      leftSection={<IconHourglass size={14} aria-hidden />}
      data-testid="open"
    >
      {t("sessions:sessions.open")}
    </Badge>
  );
}
