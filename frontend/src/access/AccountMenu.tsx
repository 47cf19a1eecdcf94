import { Button, Menu, Text, useComputedColorScheme, useMantineColorScheme } from "@mantine/core";
import { IconLock, IconLogout, IconMoon, IconSun, IconUser, IconUserCog } from "@tabler/icons-react";
import { useNavigate } from "@tanstack/react-router";
import { MENU } from "./accountWords";
import { useMe } from "./hooks";
import { access } from "./standing";
import { ROLES } from "./words";

/** Who is signed in here, and what they can do about it. */
export function AccountMenu() {
  const me = useMe();
  const navigate = useNavigate();
  const { setColorScheme } = useMantineColorScheme();
  const dark = useComputedColorScheme() === "dark";
  if (!me) return null;
  return (
    <Menu position="bottom-end" zIndex={500}>
      <Menu.Target>
        <Button
          variant="subtle"
          color="var(--mantine-color-text)"
          h={44}
          ml="auto"
          px={8}
          maw={260}
          leftSection={<IconUser size={28} />}
          styles={{ section: { marginInlineEnd: 0 } }}
          aria-label={MENU.signedInAs(me.name)}
        >
          <Text span inherit truncate visibleFrom="md" ml={8}>
            {me.name}
          </Text>
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>
          <Text size="sm">{me.name}</Text>
          <Text size="sm">{ROLES[me.role].name}</Text>
        </Menu.Label>
        <Menu.Item
          h={48}
          closeMenuOnClick={false}
          leftSection={dark ? <IconSun size={20} /> : <IconMoon size={20} />}
          onClick={() => setColorScheme(dark ? "light" : "dark")}
        >
          {dark ? MENU.light : MENU.dark}
        </Menu.Item>
        {(me.password || me.openid) && (
          <Menu.Item h={48} leftSection={<IconLock size={20} />} onClick={() => void access.lock()}>
            {MENU.lock}
          </Menu.Item>
        )}
        <Menu.Item
          h={48}
          leftSection={<IconUserCog size={20} />}
          onClick={() => void navigate({ to: "/account" })}
        >
          {MENU.account}
        </Menu.Item>
        <Menu.Item h={48} leftSection={<IconLogout size={20} />} onClick={() => void access.signOut()}>
          {MENU.signOut}
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}
