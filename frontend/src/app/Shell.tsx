import { ActionIcon, Box, Group, Menu } from "@mantine/core";
import { IconMenu2 } from "@tabler/icons-react";
import { Link, Outlet, useRouterState } from "@tanstack/react-router";
import { lazy } from "react";
import { AccountMenu } from "../features/auth/AccountMenu";
import { useHasPermission } from "../features/auth/hooks";
import { SearchButton } from "../features/search/SearchButton";
import { t } from "../lib/i18n";
import { useSavedRecords } from "../lib/live/hooks";
import { useRefetchAfterOutage } from "../lib/offline";
import { AppFrame } from "../safety/AppFrame";
import { LazyPart } from "../ui/LazyPart";
import { PageLink } from "../ui/links";
import { UndoBar } from "../ui/UndoBar";
import { useBelowHeader } from "../ui/useBelowHeader";
import { Brand } from "./Brand";
import { MissingZone } from "./MissingZone";
import { NavigationLink, type NavigationPage } from "./NavigationLink";
import { PAGES } from "./pages";
import classes from "./Shell.module.css";
import { useCurrentMark } from "./useCurrentMark";

const NotificationButton = lazy(() =>
  import("../features/notifications/NotificationButton").then((module) => ({
    default: module.NotificationButton,
  })),
);
const BELL_PX = 44;

/** The frame of every page: navigation, account menu, apparatus state and Stop. */
export function Shell() {
  useSavedRecords();
  useRefetchAfterOutage();
  // The route of the shown page. While the next page loads, the address already names the next page.
  const page = useRouterState({ select: (state) => state.matches.at(-1)?.routeId });
  return (
    <AppFrame top={<Top />} fullPageStop={page === "/station"}>
      <Box p="md" mx="auto" className={classes.content ?? ""}>
        <MissingZone />
        <Outlet />
      </Box>
      <UndoBar />
    </AppFrame>
  );
}

function Top() {
  return (
    <>
      <PageLink
        to="/"
        fw={700}
        fz={22}
        c="var(--kata-brand)"
        underline="never"
        visibleFrom="lg"
        style={{ whiteSpace: "nowrap" }}
      >
        <Brand />
      </PageLink>
      <Group
        component="nav"
        gap={4}
        wrap="nowrap"
        visibleFrom="md"
        className={classes.nav ?? ""}
        aria-label={t("common:shell.pages")}
      >
        {PAGES.map((page) => (
          <NavigationLink key={page.to} {...page} />
        ))}
      </Group>
      <PageMenu />
      <SearchButton />
      <LazyPart loading={<Box w={BELL_PX} />} failed={<Box w={BELL_PX} />}>
        <NotificationButton />
      </LazyPart>
      <AccountMenu />
    </>
  );
}

/** The same pages in a menu, on a telephone or an upright tablet, where the links do not fit. */
function PageMenu() {
  const { target, menu } = useBelowHeader();
  return (
    <Menu position="bottom-start" zIndex={500} {...menu}>
      <Menu.Target>
        <ActionIcon
          ref={target}
          variant="subtle"
          color="var(--mantine-color-text)"
          size={44}
          hiddenFrom="md"
          aria-label={t("common:shell.pages")}
        >
          <IconMenu2 size={26} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        {PAGES.map((page) => (
          <MenuLink key={page.to} {...page} />
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}

function MenuLink(page: NavigationPage) {
  const mark = useCurrentMark(page);
  if (!useHasPermission(page.needs)) return null;
  return (
    <Menu.Item h={48} component={Link} to={page.to} {...mark}>
      {page.label}
    </Menu.Item>
  );
}
