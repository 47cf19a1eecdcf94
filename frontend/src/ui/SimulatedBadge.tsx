import { Badge } from "@mantine/core";
import { t } from "../lib/i18n";

/** Marks values of a simulated apparatus. `short`: the text is short, for a table. */
export function SimulatedBadge({
  simulated,
  short = false,
}: {
  simulated: boolean | undefined;
  short?: boolean;
}) {
  if (!simulated) return null;
  return (
    <Badge variant="outline" color="grape" tt="none" miw="max-content" data-testid="simulated">
      {short ? t("common:simulatedShort") : t("common:simulated")}
    </Badge>
  );
}
