import "./catalogue";
import { Group, Stack, Title } from "@mantine/core";
import { Outlet } from "@tanstack/react-router";
import { NavigationLink } from "../../app/NavigationLink";
import { t } from "../../lib/i18n";
import { useHasPermission } from "../auth/hooks";
import { ADMINISTRATION_PAGES } from "./administrationPages";

/** The administrator's pages: accounts, audit trail, break-glass accesses, backups, clinic, and the link to the station's settings. */
export function AdministrationPage() {
  const canAdminister = useHasPermission("administer");
  return (
    <Stack>
      <Title order={1} size="h2">
        {t("administration:administration.title")}
      </Title>
      {canAdminister && (
        <>
          <Group component="nav" gap={4} aria-label={t("administration:administration.sections")}>
            {ADMINISTRATION_PAGES.map((page) => (
              <NavigationLink key={page.to} {...page} />
            ))}
          </Group>
          <Outlet />
        </>
      )}
      {!canAdminister && <p>{t("administration:administration.administratorsOnly")}</p>}
    </Stack>
  );
}
