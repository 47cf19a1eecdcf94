import { Alert } from "@mantine/core";
import { IconClock } from "@tabler/icons-react";
import { useHasPermission, useMe } from "../features/auth/hooks";
import { isZoneMissing } from "../lib/days";
import { t } from "../lib/i18n";
import { PageLink } from "../ui/links";

/** Says on every page that days and times are those of UTC, because the page has no time zone of the clinic. */
export function MissingZone() {
  const me = useMe();
  const administers = useHasPermission("administer");
  if (!me || !isZoneMissing()) return null;
  return (
    <Alert color="grape" variant="light" icon={<IconClock />} mb="md" py="xs" data-testid="missing-zone">
      {me.time_zone ? t("common:zone.unknown", { zone: me.time_zone }) : t("common:zone.missing")}{" "}
      {administers ? (
        <PageLink to="/administration/clinic" inherit>
          {t("common:zone.set")}
        </PageLink>
      ) : (
        t("common:zone.ask")
      )}
    </Alert>
  );
}
