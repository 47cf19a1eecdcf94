import {
  Button,
  Group,
  Menu,
  Modal,
  Text,
  useComputedColorScheme,
  useMantineColorScheme,
} from "@mantine/core";
import {
  IconBook,
  IconLock,
  IconLogout,
  IconMoon,
  IconSun,
  IconUser,
  IconUserCog,
} from "@tabler/icons-react";
import { useNavigate } from "@tanstack/react-router";
import { useState } from "react";
import { CURRENT, useIsOn } from "../../app/useCurrentMark";
import type { Me } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useLive } from "../../lib/live/hooks";
import { manualAddress } from "../../lib/manual";
import { useBelowHeader } from "../../ui/useBelowHeader";
import { authStore } from "./authState";
import { useMe } from "./hooks";

/** Shows the signed-in user and the actions on the own account. */
export function AccountMenu() {
  const me = useMe();
  const torque = useLive("torque");
  const operates = useLive("lease")?.mine === true;
  const [confirming, setConfirming] = useState(false);
  const { target, menu } = useBelowHeader();
  const mark = useIsOn(["/account"]) ? CURRENT : {};
  if (!me) return null;
  // Without a connection, the last known torque is used, because an arm may still be held.
  const torqueOn = torque === "on" || (torque === "unknown" && operates);
  return (
    <>
      <ConfirmSignOut
        opened={confirming}
        operates={operates && torqueOn}
        onClose={() => setConfirming(false)}
      />
      <Menu position="bottom-end" zIndex={500} {...menu}>
        <Menu.Target>
          <Button
            ref={target}
            {...mark}
            variant="subtle"
            color="var(--mantine-color-text)"
            h={44}
            px={8}
            maw={260}
            // The name is shortened before the page links are.
            miw={60}
            style={{ flexShrink: 1000 }}
            leftSection={<IconUser size={28} />}
            styles={{ section: { marginInlineEnd: 0 } }}
            aria-label={t("auth:menu.signedInAs", { name: me.name })}
          >
            <Text span inherit truncate visibleFrom="lg" ml={8}>
              {me.name}
            </Text>
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          <AccountMenuItems
            me={me}
            onSignOut={() => (torqueOn ? setConfirming(true) : void authStore.signOut())}
          />
        </Menu.Dropdown>
      </Menu>
    </>
  );
}

/** The user's name and role, and the entries below them. */
function AccountMenuItems({ me, onSignOut }: { me: Me; onSignOut: () => void }) {
  const navigate = useNavigate();
  const manual = manualAddress();
  return (
    <>
      <Menu.Label>
        <Text size="sm">{me.name}</Text>
        <Text size="sm">{t(`auth:roles.${me.role}.name`)}</Text>
      </Menu.Label>
      <ColorSchemeItem />
      {(me.password || me.openid) && (
        <Menu.Item h={48} leftSection={<IconLock size={20} />} onClick={() => void authStore.lock()}>
          {t("auth:menu.lock")}
        </Menu.Item>
      )}
      <Menu.Item
        h={48}
        leftSection={<IconUserCog size={20} />}
        onClick={() => void navigate({ to: "/account" })}
      >
        {t("auth:menu.account")}
      </Menu.Item>
      {manual && (
        <Menu.Item
          h={48}
          leftSection={<IconBook size={20} />}
          component="a"
          href={manual}
          target="_blank"
          rel="noopener"
        >
          {t("auth:menu.manual")}
        </Menu.Item>
      )}
      <Menu.Item h={48} leftSection={<IconLogout size={20} />} onClick={onSignOut}>
        {t("auth:menu.signOut")}
      </Menu.Item>
    </>
  );
}

/** Switches between light and dark. */
function ColorSchemeItem() {
  const { setColorScheme } = useMantineColorScheme();
  const dark = useComputedColorScheme() === "dark";
  return (
    <Menu.Item
      h={48}
      closeMenuOnClick={false}
      leftSection={dark ? <IconSun size={20} /> : <IconMoon size={20} />}
      onClick={() => setColorScheme(dark ? "light" : "dark")}
    >
      {dark ? t("auth:menu.light") : t("auth:menu.dark")}
    </Menu.Item>
  );
}

/**
 * Confirms a sign-out, which removes Stop from this browser. The operator cannot sign out while torque is on;
 * other users must confirm.
 */
function ConfirmSignOut({
  opened,
  operates,
  onClose,
}: {
  opened: boolean;
  operates: boolean;
  onClose: () => void;
}) {
  return (
    <Modal opened={opened} onClose={onClose} title={t("auth:menu.torqueOnTitle")} centered>
      <Text mb="md">{operates ? t("auth:menu.torqueOnOperator") : t("auth:menu.torqueOn")}</Text>
      <Group>
        <Button h={48} onClick={onClose} data-autofocus>
          {t("auth:menu.stay")}
        </Button>
        {!operates && (
          <Button h={48} variant="default" onClick={() => void authStore.signOut()}>
            {t("auth:menu.signOutAnyway")}
          </Button>
        )}
      </Group>
    </Modal>
  );
}
